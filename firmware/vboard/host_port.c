// SPDX-License-Identifier: GPL-3.0-or-later
#include "host_port.h"

#include <errno.h>
#include <fcntl.h>
#include <stdalign.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/inotify.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <termios.h>
#include <unistd.h>

static const char PTY_DIRECTORY[] = "/dev/pts/";

// Where a symbolic link points; empty if it is none.
static void read_link(const char *path, char *target, size_t size)
{
    ssize_t length = readlink(path, target, size - 1);
    target[length > 0 ? length : 0] = '\0';
}

static bool may_replace(const char *path)
{
    struct stat status;
    if (lstat(path, &status) != 0)
        return errno == ENOENT;
    char target[64];
    read_link(path, target, sizeof target);
    return strncmp(target, PTY_DIRECTORY, strlen(PTY_DIRECTORY)) == 0;
}

static bool make_link(const char *target, const char *path, char *error, size_t error_size)
{
    if (!may_replace(path)) {
        snprintf(error, error_size, "pty link %s exists and is not a link to a pseudo terminal; remove it or name another",
                 path);
        return false;
    }
    // Made beside it and renamed: a host that polls for the link never finds it missing or half made.
    char temporary[4096];
    int length = snprintf(temporary, sizeof temporary, "%s.%ld", path, (long)getpid());
    if (length >= (int)sizeof temporary)
        errno = ENAMETOOLONG;
    else if (symlink(target, temporary) == 0) {
        if (rename(temporary, path) == 0)
            return true;
        int cause = errno;
        unlink(temporary);
        errno = cause;
    }
    snprintf(error, error_size, "pty link %s: %s", path, strerror(errno));
    return false;
}

static bool open_pty(host_port *self)
{
    self->master = posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    if (self->master < 0 || grantpt(self->master) != 0 || unlockpt(self->master) != 0 ||
        ptsname_r(self->master, self->name, sizeof self->name) != 0)
        return false;
    self->slave = open(self->name, O_RDWR | O_NOCTTY | O_CLOEXEC);
    struct termios raw;
    if (self->slave < 0 || tcgetattr(self->slave, &raw) != 0)
        return false;
    cfmakeraw(&raw);
    raw.c_cflag |= HUPCL;  // as a serial port has it at first, and a pseudo terminal has not
    if (tcsetattr(self->slave, TCSANOW, &raw) != 0)
        return false;
    self->watch = inotify_init1(IN_NONBLOCK | IN_CLOEXEC);
    return self->watch >= 0 && inotify_add_watch(self->watch, self->name, IN_OPEN | IN_CLOSE) >= 0;
}

static void last_close(host_port *self)
{
    struct termios settings;
    if (tcgetattr(self->slave, &settings) != 0 || settings.c_cflag & HUPCL)
        self->dtr = false;
    ioctl(self->slave, TIOCNXCL);
    tcflush(self->slave, TCIFLUSH);
}

bool host_port_attend(host_port *self)
{
    alignas(struct inotify_event) char events[4096];
    bool raised = false;
    ssize_t size;
    while ((size = read(self->watch, events, sizeof events)) > 0)
        for (ssize_t at = 0; at < size;) {
            const struct inotify_event *event = (const struct inotify_event *)(events + at);
            at += (ssize_t)(sizeof *event + event->len);
            if (event->mask & IN_OPEN) {
                self->opened++;
                raised = raised || !self->dtr;
                self->dtr = true;
            } else if (event->mask & IN_CLOSE && self->opened > 0 && --self->opened == 0) {
                last_close(self);
            }
        }
    return raised;
}

bool host_port_open(host_port *self, const char *link, char *error, size_t error_size)
{
    *self = (host_port){.master = -1, .slave = -1, .watch = -1};
    bool ok = open_pty(self);
    if (!ok)
        snprintf(error, error_size, "pseudo terminal: %s", strerror(errno));
    else if (link)
        ok = make_link(self->name, link, error, error_size);
    if (!ok) {
        host_port_close(self);
        return false;
    }
    self->link = link;
    return true;
}

void host_port_close(host_port *self)
{
    if (self->link) {
        char target[64];
        read_link(self->link, target, sizeof target);
        if (strcmp(target, self->name) == 0)
            unlink(self->link);
    }
    if (self->watch >= 0)
        close(self->watch);
    if (self->slave >= 0)
        close(self->slave);
    if (self->master >= 0)
        close(self->master);
}
