// SPDX-License-Identifier: GPL-3.0-or-later
//
// towtank-vboard: the virtual board in real time, its UART on a pseudo terminal, its terminals on a socket.
#include <errno.h>
#include <getopt.h>
#include <inttypes.h>
#include <math.h>
#include <poll.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/signalfd.h>
#include <time.h>
#include <unistd.h>

#include "bench_socket.h"
#include "host_port.h"
#include "host_speed.h"
#include "random.h"
#include "vboard.h"

enum {
    QUANTUM_NS = 500000,         // emulated at a stretch, then I/O
    START_DELAY_NS = 20000000,   // for loading and opening, so that the board does not begin behind time
    PRIORITY = -10,              // a real board is never short of processor time
};

typedef struct arguments {
    const char *elf, *pty_link, *bench_socket;
    vb_options options;
    vb_faults faults;
    bool dtr_ignored;
} arguments;

// One line for the user, and the end.
__attribute__((noreturn, format(printf, 1, 2))) static void fail(const char *format, ...)
{
    va_list values;
    va_start(values, format);
    fputs("towtank-vboard: ", stderr);
    vfprintf(stderr, format, values);
    fputc('\n', stderr);
    va_end(values);
    exit(EXIT_FAILURE);
}

// ------------------------------------------------------------------------------- arguments

static const char usage[] =
    "usage: towtank-vboard --elf FILE --bench-socket PATH [options]\n"
    "Runs the board's firmware in real time. Prints `ready pty=/dev/pts/N` when it runs.\n"
    "  --elf FILE              firmware for the ATmega2560\n"
    "  --bench-socket PATH     SOCK_SEQPACKET socket to listen on for bench frames\n"
    "  --pty-link PATH         symbolic link to the serial port\n"
    "  --crank-cpr N           crank encoder, counts per revolution after ×4 decoding (4096)\n"
    "  --carriage-cpr N        carriage encoder, likewise (4096)\n"
    "  --crank-motor           the crank is turned by its motor, which the firmware drives, not by the bench\n"
    "  --clock-ppm X           the board's crystal runs X ppm fast (0)\n"
    "  --adc-clock-ppm X       the ADC's oscillator runs X ppm fast (0)\n"
    "  --bootloader WHICH      what a reset starts before the firmware: shipped (Arduino's, on every Mega), old\n"
    "                          (until 2012), none (the fuses of firmware/README.md) (shipped)\n"
    "  --no-dtr-reset          opening the port does not reset the board\n"
    "  --adc-sync-goes-on      the ADC's SYNC lets its sequence go on where it was held, not begin anew\n"
    "  --seed N                of noise and faults (1)\n"
    "  --eeprom FILE           file that is the EEPROM, made if missing (a blank one)\n"
    "  --noise V,V,V,V,V,V     standard deviation of a conversion in volts at the ADC, one per channel;\n"
    "                          a single value holds for all (board.yaml's)\n"
    "faults:\n"
    "  --spi-error-one-in N    one ADC read in N has a bit flipped\n"
    "  --adc-silent            the ADC does not answer\n"
    "  --bit-error-rate P      per data bit of the serial line\n"
    "  --byte-drop-rate P      per byte of the serial line\n"
    "  --byte-double-rate P    per byte of the serial line\n"
    "signals: SIGTERM and SIGINT end it, SIGUSR1 prints the statistics, SIGUSR2 resets the board\n";

static double parse_number(const char *option, const char *text, double minimum, double maximum)
{
    char *end;
    errno = 0;
    double value = strtod(text, &end);
    if (end == text || *end || errno || !(value >= minimum && value <= maximum))
        fail("--%s %s: give a number from %g to %g", option, text, minimum, maximum);
    return value;
}

static uint64_t parse_integer(const char *option, const char *text, uint64_t minimum, uint64_t maximum)
{
    char *end;
    errno = 0;
    unsigned long long value = strtoull(text, &end, 10);
    if (end == text || *end || errno || text[0] == '-' || value < minimum || value > maximum)
        fail("--%s %s: give a whole number from %" PRIu64 " to %" PRIu64, option, text, minimum, maximum);
    return value;
}

static uint32_t parse_bootloader(const char *text)
{
    static const char *const names[] = {
        [VB_BOOTLOADER_NONE] = "none", [VB_BOOTLOADER_SHIPPED] = "shipped", [VB_BOOTLOADER_OLD] = "old"};
    for (uint32_t i = 0; i < sizeof names / sizeof *names; i++)
        if (strcmp(text, names[i]) == 0)
            return i;
    fail("--bootloader %s: give shipped, old or none", text);
}

static void parse_noise(const char *text, double noise[BOARD_CHANNEL_COUNT])
{
    char copy[256];
    if (strlen(text) >= sizeof copy)
        fail("--noise: give one value or %u, separated by commas", BOARD_CHANNEL_COUNT);
    strcpy(copy, text);
    unsigned count = 0;
    for (char *value = strtok(copy, ","); value; value = strtok(NULL, ",")) {
        if (count == BOARD_CHANNEL_COUNT)
            fail("--noise %s: more values than the %u channels", text, BOARD_CHANNEL_COUNT);
        noise[count++] = parse_number("noise", value, 0.0, 1.0);
    }
    if (count == 1)
        while (count < BOARD_CHANNEL_COUNT)
            noise[count++] = noise[0];
    if (count != BOARD_CHANNEL_COUNT)
        fail("--noise %s: give one value or %u, separated by commas", text, BOARD_CHANNEL_COUNT);
}

enum {
    OPTION_ELF = 256,
    OPTION_BENCH_SOCKET,
    OPTION_PTY_LINK,
    OPTION_CRANK_CPR,
    OPTION_CARRIAGE_CPR,
    OPTION_CRANK_MOTOR,
    OPTION_CLOCK_PPM,
    OPTION_ADC_CLOCK_PPM,
    OPTION_ADC_SYNC_GOES_ON,
    OPTION_BOOTLOADER,
    OPTION_NO_DTR_RESET,
    OPTION_SEED,
    OPTION_NOISE,
    OPTION_EEPROM,
    OPTION_SPI_ERROR_ONE_IN,
    OPTION_ADC_SILENT,
    OPTION_BIT_ERROR_RATE,
    OPTION_BYTE_DROP_RATE,
    OPTION_BYTE_DOUBLE_RATE,
    OPTION_HELP,
};

static const struct option long_options[] = {
    {"elf", required_argument, NULL, OPTION_ELF},
    {"bench-socket", required_argument, NULL, OPTION_BENCH_SOCKET},
    {"pty-link", required_argument, NULL, OPTION_PTY_LINK},
    {"crank-cpr", required_argument, NULL, OPTION_CRANK_CPR},
    {"carriage-cpr", required_argument, NULL, OPTION_CARRIAGE_CPR},
    {"crank-motor", no_argument, NULL, OPTION_CRANK_MOTOR},
    {"clock-ppm", required_argument, NULL, OPTION_CLOCK_PPM},
    {"adc-clock-ppm", required_argument, NULL, OPTION_ADC_CLOCK_PPM},
    {"bootloader", required_argument, NULL, OPTION_BOOTLOADER},
    {"no-dtr-reset", no_argument, NULL, OPTION_NO_DTR_RESET},
    {"adc-sync-goes-on", no_argument, NULL, OPTION_ADC_SYNC_GOES_ON},
    {"seed", required_argument, NULL, OPTION_SEED},
    {"noise", required_argument, NULL, OPTION_NOISE},
    {"eeprom", required_argument, NULL, OPTION_EEPROM},
    {"spi-error-one-in", required_argument, NULL, OPTION_SPI_ERROR_ONE_IN},
    {"adc-silent", no_argument, NULL, OPTION_ADC_SILENT},
    {"bit-error-rate", required_argument, NULL, OPTION_BIT_ERROR_RATE},
    {"byte-drop-rate", required_argument, NULL, OPTION_BYTE_DROP_RATE},
    {"byte-double-rate", required_argument, NULL, OPTION_BYTE_DOUBLE_RATE},
    {"help", no_argument, NULL, OPTION_HELP},
    {0},
};

static arguments parse_arguments(int argc, char **argv)
{
    arguments parsed = {0};
    vb_default_options(&parsed.options);
    parsed.options.bootloader = VB_BOOTLOADER_SHIPPED;
    vb_options *options = &parsed.options;
    vb_faults *faults = &parsed.faults;
    int option, index;
    while ((option = getopt_long(argc, argv, "", long_options, &index)) != -1) {
        const char *name = option == '?' ? "" : long_options[index].name;
        switch (option) {
        case OPTION_ELF: parsed.elf = optarg; break;
        case OPTION_BENCH_SOCKET: parsed.bench_socket = optarg; break;
        case OPTION_PTY_LINK: parsed.pty_link = optarg; break;
        case OPTION_CRANK_CPR:
            options->crank_counts_per_revolution = (uint32_t)parse_integer(name, optarg, 1, 1000000);
            break;
        case OPTION_CARRIAGE_CPR:
            options->carriage_counts_per_revolution = (uint32_t)parse_integer(name, optarg, 1, 1000000);
            break;
        case OPTION_CRANK_MOTOR: options->crank = VB_CRANK_MOTOR; break;
        case OPTION_CLOCK_PPM: options->clock_ppm = parse_number(name, optarg, -1e5, 1e5); break;
        case OPTION_ADC_CLOCK_PPM: options->adc_clock_ppm = parse_number(name, optarg, -1e5, 1e5); break;
        case OPTION_BOOTLOADER: options->bootloader = parse_bootloader(optarg); break;
        case OPTION_NO_DTR_RESET: parsed.dtr_ignored = true; break;
        case OPTION_ADC_SYNC_GOES_ON: options->adc_sequence = VB_SEQUENCE_GOES_ON; break;
        case OPTION_SEED: options->seed = parse_integer(name, optarg, 0, UINT64_MAX); break;
        case OPTION_EEPROM: options->eeprom_path = optarg; break;
        case OPTION_NOISE: parse_noise(optarg, options->noise_volts); break;
        case OPTION_SPI_ERROR_ONE_IN:
            faults->spi_error_one_in = (uint32_t)parse_integer(name, optarg, 0, UINT32_MAX);
            break;
        case OPTION_ADC_SILENT: faults->adc_silent = 1; break;
        case OPTION_BIT_ERROR_RATE: faults->serial_bit_error_rate = parse_number(name, optarg, 0, 1); break;
        case OPTION_BYTE_DROP_RATE: faults->serial_byte_drop_rate = parse_number(name, optarg, 0, 1); break;
        case OPTION_BYTE_DOUBLE_RATE: faults->serial_byte_double_rate = parse_number(name, optarg, 0, 1); break;
        case OPTION_HELP: fputs(usage, stdout); exit(EXIT_SUCCESS);
        default: fail("try --help");
        }
    }
    if (optind < argc)
        fail("%s: an argument without an option; try --help", argv[optind]);
    if (!parsed.elf)
        fail("--elf is missing; build/firmware/towtank_board.elf comes from make -C firmware");
    if (!parsed.bench_socket)
        fail("--bench-socket is missing; name a path for the socket");
    return parsed;
}

// ------------------------------------------------------------------------------ real time

typedef struct real_time {
    vb_board *board;
    host_port port;
    bench_socket socket;
    int signals;
    bool dtr_ignored;
    random_source noise;         // what a wrong speed makes of bytes
    uint64_t late_quanta;        // begun more than one quantum late: the host stalled
    uint64_t bytes_unread;       // lost because no host read the port
    int64_t largest_lateness_ns;
} real_time;

static int64_t monotonic_ns(void)
{
    struct timespec time;
    clock_gettime(CLOCK_MONOTONIC, &time);
    return (int64_t)time.tv_sec * 1000000000 + time.tv_nsec;
}

static void sleep_until(int64_t ns)
{
    if (monotonic_ns() >= ns)  // catching up: no need to ask the kernel
        return;
    struct timespec time = {.tv_sec = ns / 1000000000, .tv_nsec = ns % 1000000000};
    // A signal may cut this short: the caller then emulates up to the clock's time all the same.
    clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &time, NULL);
}

static void print_statistics(const real_time *self)
{
    vb_counters c;
    vb_get_counters(self->board, &c);
    fprintf(stderr,
            "{\"bench_frames\": %" PRIu64 ", \"bench_frames_malformed\": %" PRIu64 ", \"bench_frames_late\": %" PRIu64
            ", \"conversions\": %" PRIu64 ", \"conversions_starved\": %" PRIu64
            ", \"conversions_out_of_range\": %" PRIu64 ", \"bytes_from_host\": %" PRIu64
            ", \"bytes_to_host\": %" PRIu64 ", \"bytes_unread\": %" PRIu64 ", \"late_quanta\": %" PRIu64
            ", \"largest_lateness_ms\": %.3f, \"resets\": %" PRIu64 ", \"crank_counts\": %" PRId64
            ", \"carriage_counts\": %" PRId64 ", \"spi_misuse\": %" PRIu64 ", \"spi_errors_injected\": %" PRIu64
            ", \"serial_bits_flipped\": %" PRIu64 ", \"serial_bytes_dropped\": %" PRIu64
            ", \"serial_bytes_doubled\": %" PRIu64 "}\n",
            c.bench_frames, c.bench_frames_malformed, c.bench_frames_late, c.conversions, c.conversions_starved,
            c.conversions_out_of_range, c.bytes_from_host, c.bytes_to_host, self->bytes_unread, self->late_quanta,
            (double)self->largest_lateness_ns * 1e-6, c.resets, c.crank_counts, c.carriage_counts, c.spi_misuse,
            c.spi_errors_injected, c.serial_bits_flipped, c.serial_bytes_dropped, c.serial_bytes_doubled);
}

// At another speed than the board's, neither side can read the other.
static void garble_at_wrong_speed(real_time *self, uint8_t *bytes, size_t count)
{
    if (host_speed(self->port.slave) != BOARD_WIRE_BAUD)
        for (size_t i = 0; i < count; i++)
            bytes[i] = (uint8_t)random_u64(&self->noise);
}

static void take_from_host(real_time *self)
{
    uint8_t bytes[256];
    ssize_t count;
    while ((count = read(self->port.master, bytes, sizeof bytes)) > 0) {
        garble_at_wrong_speed(self, bytes, (size_t)count);
        vb_write(self->board, bytes, (size_t)count);
    }
}

static void give_to_host(real_time *self)
{
    uint8_t bytes[256];
    size_t count;
    while ((count = vb_read(self->board, bytes, sizeof bytes)) > 0) {
        garble_at_wrong_speed(self, bytes, count);
        // Nobody has the port open, or nobody reads it and its buffer is full: lost, as on a wire.
        ssize_t written = self->port.opened ? write(self->port.master, bytes, count) : 0;
        self->bytes_unread += count - (size_t)(written > 0 ? written : 0);
    }
}

// One at a time: whoever has had the statistics may open or close the port before asking for them again, and that is
// looked at first. False when it is time to end.
static bool obey_signal(real_time *self)
{
    struct signalfd_siginfo signal;
    if (read(self->signals, &signal, sizeof signal) != sizeof signal)
        return true;
    if (signal.ssi_signo == SIGUSR1)
        print_statistics(self);
    else if (signal.ssi_signo == SIGUSR2)
        vb_reset(self->board, BOARD_RESET_CAUSE_EXTERNAL);
    else
        return false;
    return true;
}

static bool serve(real_time *self)
{
    struct pollfd files[] = {
        {.fd = self->port.master, .events = POLLIN},
        {.fd = self->socket.bench >= 0 ? self->socket.bench : self->socket.listener, .events = POLLIN},
        {.fd = self->signals, .events = POLLIN},
        {.fd = self->port.watch, .events = POLLIN},
    };
    if (poll(files, sizeof files / sizeof *files, 0) <= 0)
        return true;
    if (files[3].revents && host_port_attend(&self->port) && !self->dtr_ignored)
        vb_reset(self->board, BOARD_RESET_CAUSE_EXTERNAL);
    if (files[0].revents)
        take_from_host(self);
    if (files[1].revents)
        bench_socket_serve(&self->socket, self->board);
    return !files[2].revents || obey_signal(self);
}

// Returns 0, or -1 if the firmware has stopped.
static int run(real_time *self, int64_t start_ns)
{
    // Deadlines are absolute: after a stall the board catches up, quantum by quantum, and does not drift.
    for (int64_t deadline = start_ns + QUANTUM_NS;; deadline += QUANTUM_NS) {
        sleep_until(deadline);
        int64_t lateness = monotonic_ns() - deadline;
        if (lateness > QUANTUM_NS)
            self->late_quanta++;
        if (lateness > self->largest_lateness_ns)
            self->largest_lateness_ns = lateness;
        if (!serve(self))
            return 0;
        if (vb_run_until(self->board, deadline) != 0)
            return -1;
        give_to_host(self);
    }
}

static int block_signals(void)
{
    sigset_t signals;
    sigemptyset(&signals);
    sigaddset(&signals, SIGTERM);
    sigaddset(&signals, SIGINT);
    sigaddset(&signals, SIGUSR1);
    sigaddset(&signals, SIGUSR2);
    sigprocmask(SIG_BLOCK, &signals, NULL);
    return signalfd(-1, &signals, SFD_NONBLOCK | SFD_CLOEXEC);
}

int main(int argc, char **argv)
{
    arguments parsed = parse_arguments(argc, argv);
    char error[512];
    real_time self = {.signals = block_signals(),
                      .dtr_ignored = parsed.dtr_ignored,
                      .noise = random_stream(parsed.options.seed, 5)};
    setpriority(PRIO_PROCESS, 0, PRIORITY);  // if the user may; it runs without, too
    prctl(PR_SET_TIMERSLACK, 1000);  // wake within 1 µs of the deadline, not 50

    parsed.options.start_ns = monotonic_ns() + START_DELAY_NS;
    self.board = vb_open(parsed.elf, &parsed.options, error, sizeof error);
    if (!self.board)
        fail("%s", error);
    vb_set_faults(self.board, &parsed.faults);
    if (!bench_socket_open(&self.socket, parsed.bench_socket, error, sizeof error))
        fail("%s", error);
    if (!host_port_open(&self.port, parsed.pty_link, error, sizeof error)) {
        bench_socket_close(&self.socket);
        fail("%s", error);
    }
    printf("ready pty=%s\n", self.port.name);
    fflush(stdout);

    int result = run(&self, parsed.options.start_ns);
    host_port_close(&self.port);
    bench_socket_close(&self.socket);
    print_statistics(&self);
    if (result != 0)
        fprintf(stderr, "towtank-vboard: %s; reset it by starting again\n", vb_stop_reason(self.board));
    vb_close(self.board);
    return result == 0 ? EXIT_SUCCESS : EXIT_FAILURE;
}
