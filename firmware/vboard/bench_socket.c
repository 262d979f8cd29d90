// SPDX-License-Identifier: GPL-3.0-or-later
#include "bench_socket.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

// Removes what a board that was killed has left; anything else in the way stays.
static bool clear_path(const struct sockaddr_un *address, char *error, size_t error_size)
{
    struct stat status;
    if (lstat(address->sun_path, &status) != 0)
        return true;
    if (!S_ISSOCK(status.st_mode)) {
        snprintf(error, error_size, "bench socket %s exists and is not a socket; remove it or name another",
                 address->sun_path);
        return false;
    }
    int probe = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0);
    bool stale = connect(probe, (const struct sockaddr *)address, sizeof *address) != 0 && errno == ECONNREFUSED;
    close(probe);
    if (!stale) {
        snprintf(error, error_size, "bench socket %s is in use; stop the other virtual board or name another",
                 address->sun_path);
        return false;
    }
    unlink(address->sun_path);
    return true;
}

bool bench_socket_open(bench_socket *self, const char *path, char *error, size_t error_size)
{
    *self = (bench_socket){.listener = -1, .bench = -1};
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    if (strlen(path) >= sizeof address.sun_path) {
        snprintf(error, error_size, "bench socket %s: the path is longer than %zu characters", path,
                 sizeof address.sun_path - 1);
        return false;
    }
    strcpy(address.sun_path, path);
    if (!clear_path(&address, error, error_size))
        return false;
    self->listener = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    if (self->listener < 0 || bind(self->listener, (struct sockaddr *)&address, sizeof address) != 0) {
        snprintf(error, error_size, "bench socket %s: %s", path, strerror(errno));
        bench_socket_close(self);
        return false;
    }
    self->path = path;
    if (listen(self->listener, 1) != 0) {
        snprintf(error, error_size, "bench socket %s: %s", path, strerror(errno));
        bench_socket_close(self);
        return false;
    }
    return true;
}

void bench_socket_close(bench_socket *self)
{
    if (self->bench >= 0)
        close(self->bench);
    if (self->listener >= 0)
        close(self->listener);
    if (self->path)
        unlink(self->path);
}

static void receive_frames(bench_socket *self, vb_board *board)
{
    for (;;) {
        uint8_t frame[BENCH_FRAME_SIZE];
        // MSG_TRUNC: the packet's true length, so that one too long is seen as such.
        ssize_t size = recv(self->bench, frame, sizeof frame, MSG_DONTWAIT | MSG_TRUNC);
        if (size > 0) {
            vb_push_bench(board, frame, (size_t)size);
            continue;
        }
        if (size == 0 || (errno != EAGAIN && errno != EINTR)) {  // the bench has gone
            close(self->bench);
            self->bench = -1;
        }
        return;
    }
}

void bench_socket_serve(bench_socket *self, vb_board *board)
{
    if (self->bench >= 0)
        receive_frames(self, board);
    if (self->bench < 0) {
        self->bench = accept4(self->listener, NULL, NULL, SOCK_NONBLOCK | SOCK_CLOEXEC);
        if (self->bench >= 0) {
            vb_restart_bench(board);
            receive_frames(self, board);
        }
    }
}
