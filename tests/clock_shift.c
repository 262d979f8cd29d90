/* SPDX-License-Identifier: Apache-2.0 */
/* Preloaded into a program, it sets that program's system clock: CLOCK_REALTIME goes wrong by the
   nanoseconds that stand in the file CLOCK_SHIFT_FILE (an int64), from the moment they are written
   there. Waits until a time of that clock end by it, too, as the kernel has them do. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <semaphore.h>
#include <stdint.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/time.h>
#include <time.h>
#include <unistd.h>

#define NS 1000000000LL
#define SLICE_NS 20000000LL

static const volatile int64_t *shift;

static int64_t shift_ns(void) { return shift ? *shift : 0; }

__attribute__((constructor)) static void map_file(void) {
  const char *path = getenv("CLOCK_SHIFT_FILE");
  int file = path ? open(path, O_RDONLY | O_CLOEXEC) : -1;
  if (file < 0) return;
  void *mapped = mmap(NULL, sizeof(int64_t), PROT_READ, MAP_SHARED, file, 0);
  close(file);
  if (mapped != MAP_FAILED) shift = mapped;
}

static int (*real(const char *name))() { return (int (*)())dlsym(RTLD_NEXT, name); }

static struct timespec moved(struct timespec t, int64_t by_ns) {
  int64_t ns = t.tv_sec * NS + t.tv_nsec + by_ns;
  return (struct timespec){ns / NS, ns % NS};
}

int clock_gettime(clockid_t clock, struct timespec *now) {
  static int (*next)(clockid_t, struct timespec *);
  if (!next) next = (int (*)(clockid_t, struct timespec *))real("clock_gettime");
  int status = next(clock, now);
  if (clock == CLOCK_REALTIME || clock == CLOCK_REALTIME_COARSE) *now = moved(*now, shift_ns());
  return status;
}

int gettimeofday(struct timeval *restrict now, void *restrict zone) {
  (void)zone;
  struct timespec precise;
  clock_gettime(CLOCK_REALTIME, &precise);
  *now = (struct timeval){precise.tv_sec, precise.tv_nsec / 1000};
  return 0;
}

time_t time(time_t *result) {
  struct timespec now;
  clock_gettime(CLOCK_REALTIME, &now);
  if (result) *result = now.tv_sec;
  return now.tv_sec;
}

/* The kernel's own clock is not set. So a wait until a time of the system's clock is made of short
   ones, until the clock as the program sees it has got there. */
static int is_over(const struct timespec *until) {
  struct timespec now;
  clock_gettime(CLOCK_REALTIME, &now);
  return now.tv_sec > until->tv_sec ||
         (now.tv_sec == until->tv_sec && now.tv_nsec >= until->tv_nsec);
}

static struct timespec slice(const struct timespec *until) {
  struct timespec now;
  clock_gettime(CLOCK_REALTIME, &now);
  int64_t left = (until->tv_sec - now.tv_sec) * NS + until->tv_nsec - now.tv_nsec;
  if (left > SLICE_NS) left = SLICE_NS;
  return moved(now, (left > 0 ? left : 0) - shift_ns());
}

/* Monotonic conditions have small times, which are none of the system's clock. */
static int of_the_system(const struct timespec *until) { return until->tv_sec > 1000000000; }

int pthread_cond_timedwait(pthread_cond_t *restrict condition, pthread_mutex_t *restrict mutex,
                           const struct timespec *restrict until) {
  static int (*next)(pthread_cond_t *, pthread_mutex_t *, const struct timespec *);
  if (!next)
    next = (int (*)(pthread_cond_t *, pthread_mutex_t *, const struct timespec *))dlvsym(
        RTLD_NEXT, "pthread_cond_timedwait", "GLIBC_2.3.2");
  if (!of_the_system(until)) return next(condition, mutex, until);
  struct timespec end = slice(until);
  int status = next(condition, mutex, &end);
  /* Waiting on in here would miss what was signalled in between; the caller looks and comes back. */
  return status == ETIMEDOUT && !is_over(until) ? 0 : status;
}

int pthread_mutex_timedlock(pthread_mutex_t *restrict mutex,
                            const struct timespec *restrict until) {
  static int (*next)(pthread_mutex_t *, const struct timespec *);
  if (!next)
    next = (int (*)(pthread_mutex_t *, const struct timespec *))real("pthread_mutex_timedlock");
  for (;;) {
    struct timespec end = slice(until);
    int status = next(mutex, &end);
    if (status != ETIMEDOUT || is_over(until)) return status;
  }
}

int sem_timedwait(sem_t *restrict semaphore, const struct timespec *restrict until) {
  static int (*next)(sem_t *, const struct timespec *);
  if (!next) next = (int (*)(sem_t *, const struct timespec *))real("sem_timedwait");
  for (;;) {
    struct timespec end = slice(until);
    int status = next(semaphore, &end);
    if (status == 0 || errno != ETIMEDOUT || is_over(until)) return status;
  }
}
