// SPDX-License-Identifier: GPL-3.0-or-later
#include "mcu.h"

#include <assert.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include "board_protocol.h"
#include "elf_image.h"

// Cycles that the core may run before it looks at its timers again; they still fire in time, because arming
// one shortens the run. It almost doubles the speed.
static const avr_cycle_count_t RUN_CYCLE_LIMIT = 1000;

static const uint32_t EEPROM_BYTE_US = 3400;  // erase and write

static void no_sleep(avr_t *avr, avr_cycle_count_t cycles)
{
    // Pacing is the caller's; the core has already jumped over the cycles slept.
    (void)avr;
    (void)cycles;
}

avr_io_t *mcu_module(const mcu *self, const char *kind)
{
    for (avr_io_t *module = self->avr->io_port; module; module = module->next)
        if (strcmp(module->kind, kind) == 0)
            return module;
    return NULL;
}

avr_ioport_t *mcu_port(const mcu *self, char name)
{
    for (avr_io_t *module = self->avr->io_port; module; module = module->next)
        if (strcmp(module->kind, "port") == 0 && ((avr_ioport_t *)module)->name == name)
            return (avr_ioport_t *)module;
    return NULL;
}

// ------------------------------------------------------------------------- interrupt flags

// The instruction being executed is SBI, which touches its one bit only.
static bool executes_sbi(const avr_t *avr)
{
    return avr->flash[avr->pc + 1] == 0x9A;
}

// EIFR and TIFRn: writing a one clears that flag and no other. (simavr stores to EIFR, and clears every flag
// of a timer on any write to its TIFR.)
static void write_flags(avr_t *avr, avr_io_addr_t address, uint8_t value, void *param)
{
    (void)param;
    if (executes_sbi(avr))  // simavr has or-ed in the flags that were set before
        value = (uint8_t)(1u << (avr->flash[avr->pc] & 7));
    avr_int_table_p table = &avr->interrupts;
    for (int i = 0; i < table->vector_count; i++) {
        avr_int_vector_t *vector = table->vector[i];
        if (vector->raised.reg == address && value >> vector->raised.bit & 1) {
            avr_clear_interrupt(avr, vector);
            avr_regbit_clear(avr, vector->raised);
        }
    }
}

// EIMSK and TIMSKn: an interrupt whose flag is already set comes as soon as it is enabled.
static void write_mask(avr_t *avr, avr_io_addr_t address, uint8_t value, void *param)
{
    (void)param;
    avr_core_watch_write(avr, address, value);
    avr_int_table_p table = &avr->interrupts;
    for (int i = 0; i < table->vector_count; i++) {
        avr_int_vector_t *vector = table->vector[i];
        if (vector->enable.reg == address && value >> vector->enable.bit & 1 &&
            avr_regbit_get(avr, vector->raised))
            avr_raise_interrupt(avr, vector);
    }
}

static void mend_interrupt_flags(avr_t *avr, const avr_int_vector_t *vector)
{
    // Set directly: avr_register_io_write would call simavr's handler as well.
    avr->io[AVR_DATA_TO_IO(vector->raised.reg)].w.c = write_flags;
    avr->io[AVR_DATA_TO_IO(vector->enable.reg)].w.c = write_mask;
}

// ---------------------------------------------------------------------------------- reset

// MCUSR: software can clear its flags, not set them.
static void write_reset_flags(avr_t *avr, avr_io_addr_t address, uint8_t value, void *param)
{
    mcu *self = param;
    self->reset_flags &= value;
    avr_core_watch_write(avr, address, self->reset_flags);
}

static void after_reset(avr_io_t *hook)
{
    mcu *self = (mcu *)((char *)hook - offsetof(mcu, reset_hook));
    avr_t *avr = self->avr;
    self->resets++;
    self->held = false;
    // avr_reset has wiped the registers (the RAM stays) and set only the flag of a watchdog reset.
    uint16_t mcusr = avr->reset_flags.porf.reg;
    self->reset_flags |= avr->data[mcusr];
    avr->data[mcusr] = self->reset_flags;
    avr->run_cycle_limit = RUN_CYCLE_LIMIT;
    // Level-triggered interrupts of a low pin would be polled on every cycle from the start.
    for (int i = 0; i < EXTINT_COUNT; i++)
        avr_extint_set_strict_lvl_trig(avr, i, 0);
    self->on_reset(self->context);
}

static void scramble_ram(mcu *self)
{
    for (unsigned i = self->avr->ioend + 1u; i <= self->avr->ramend; i++)
        self->avr->data[i] = (uint8_t)random_u64(&self->ram_noise);
}

static avr_cycle_count_t eeprom_written(avr_t *avr, avr_cycle_count_t when, void *param)
{
    (void)when;
    avr_regbit_clear(avr, ((mcu *)param)->eeprom->eepe);
    return 0;
}

// EECR: EEPE reads as one until the byte is written. (simavr clears it at once.)
static void write_eecr(avr_t *avr, avr_io_addr_t address, uint8_t value, void *param)
{
    mcu *self = param;
    const avr_eeprom_t *eeprom = self->eeprom;
    bool begins = avr_regbit_get(avr, eeprom->eempe) && value >> eeprom->eepe.bit & 1;
    bool busy = avr_regbit_get(avr, eeprom->eepe);
    self->write_eecr(avr, address, value, self->write_eecr_param);
    if (begins)
        avr_cycle_timer_register_usec(avr, EEPROM_BYTE_US, eeprom_written, self);
    if (begins || busy)
        avr_regbit_set(avr, eeprom->eepe);
}

static void mend_eeprom(mcu *self)
{
    avr_io_addr_t eecr = AVR_DATA_TO_IO(self->eeprom->r_eecr);
    self->write_eecr = self->avr->io[eecr].w.c;
    self->write_eecr_param = self->avr->io[eecr].w.param;
    self->avr->io[eecr].w.c = write_eecr;
    self->avr->io[eecr].w.param = self;
}

// The power leaves in the middle of a write: the byte is neither the old one nor the new one.
static void spoil_eeprom(mcu *self)
{
    avr_t *avr = self->avr;
    const avr_eeprom_t *eeprom = self->eeprom;
    unsigned address = avr->data[eeprom->r_eearl] | avr->data[eeprom->r_eearh] << 8;
    if (avr_regbit_get(avr, eeprom->eepe) && address < eeprom->size)
        eeprom->eeprom[address] = (uint8_t)random_u64(&self->ram_noise);
}

bool mcu_preset(mcu *self, const char *variable, size_t offset, const uint8_t *bytes, size_t count)
{
    size_t address, size;
    if (!elf_image_variable(self->elf_path, variable, &address, &size) || offset > size || count > size - offset ||
        address + size > self->avr->ramend + 1u)
        return false;
    memcpy(self->avr->data + address + offset, bytes, count);
    return true;
}

void mcu_reset(mcu *self, uint8_t cause)
{
    if (cause == BOARD_RESET_CAUSE_POWER_ON || cause == BOARD_RESET_CAUSE_BROWN_OUT)
        spoil_eeprom(self);
    if (cause == BOARD_RESET_CAUSE_POWER_ON) {
        scramble_ram(self);
        self->reset_flags = 0;
    }
    if (cause != BOARD_RESET_CAUSE_WATCHDOG)
        self->reset_flags |= cause;
    // WDRF keeps the watchdog on, at its shortest period, over any reset: as simavr's watchdog does it
    if (cause == BOARD_RESET_CAUSE_WATCHDOG || self->reset_flags & BOARD_RESET_CAUSE_WATCHDOG) {
        self->watchdog->reset_context.avr_run = self->run;
        self->watchdog->reset_context.wdrf = 1;
    }
    avr_reset(self->avr);
}

void mcu_clear_reset_flags(mcu *self)
{
    self->reset_flags = 0;
    self->avr->data[self->avr->reset_flags.porf.reg] = 0;
}

void mcu_stop_watchdog(mcu *self)
{
    avr_t *avr = self->avr;
    avr_io_addr_t wdtcsr = self->watchdog->wde.reg;
    uint8_t change = (uint8_t)(1u << self->watchdog->wdce.bit | 1u << self->watchdog->wde.bit);
    const uint8_t sequence[] = {change, 0};
    for (size_t i = 0; i < sizeof sequence; i++)
        avr->io[AVR_DATA_TO_IO(wdtcsr)].w.c(avr, wdtcsr, sequence[i], avr->io[AVR_DATA_TO_IO(wdtcsr)].w.param);
}

bool mcu_hang(mcu *self, bool interrupts_go_on)
{
    avr_t *avr = self->avr;
    for (avr_flashaddr_t address = 0; address < avr->flashend; address += 2) {
        if (avr->flash[address] != 0xFF || avr->flash[address + 1] != 0xCF)  // rjmp to itself
            continue;
        avr->pc = address;
        // Also where it strikes in a section without interrupts. simavr serves them after the next instruction
        if (interrupts_go_on && !avr->sreg[S_I])
            avr->interrupt_state = -1;
        else if (!interrupts_go_on)
            avr->interrupt_state = 0;
        avr->sreg[S_I] = interrupts_go_on;
        return true;
    }
    return false;
}

void mcu_stray_interrupt(mcu *self)
{
    avr_regbit_set(self->avr, self->idle_timer->overflow.enable);
    avr_raise_interrupt(self->avr, &self->idle_timer->overflow);
}

// --------------------------------------------------------------------------- open and close

// Puts a file, mapped, where simavr has its EEPROM: what the firmware writes is in the file at once.
static bool map_eeprom(mcu *self, const char *path, char *error, size_t error_size)
{
    size_t size = self->eeprom->size;
    int file = open(path, O_RDWR | O_CREAT | O_CLOEXEC, 0666);
    struct stat status;
    const char *problem = NULL;
    void *bytes = MAP_FAILED;
    if (file < 0 || fstat(file, &status) != 0)
        problem = strerror(errno);
    else if (status.st_size == 0 && write(file, self->eeprom->eeprom, size) != (ssize_t)size)
        problem = "cannot be filled; make room on its disk";
    else if (status.st_size != 0 && (size_t)status.st_size != size)
        problem = "is no EEPROM of an ATmega2560 (4096 bytes); name another file";
    else if ((bytes = mmap(NULL, size, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0)) == MAP_FAILED)
        problem = strerror(errno);
    if (file >= 0)
        close(file);
    if (problem) {
        snprintf(error, error_size, "EEPROM %s: %s", path, problem);
        return false;
    }
    self->own_eeprom = self->eeprom->eeprom;
    self->eeprom->eeprom = bytes;
    return true;
}

bool mcu_open(mcu *self, const char *elf_path, const char *eeprom_path, uint64_t seed, void (*on_reset)(void *),
              void *context, char *error, size_t error_size)
{
    *self = (mcu){.on_reset = on_reset, .context = context, .ram_noise = random_stream(seed, 2)};
    self->elf_path = strdup(elf_path);
    avr_t *avr = self->avr = avr_make_mcu_by_name("atmega2560");
    if (!avr) {
        snprintf(error, error_size, "libsimavr has no ATmega2560; install libsimavr 1.6");
        return false;
    }
    avr_init(avr);
    avr->frequency = BOARD_CLOCK_HZ;
    avr->sleep = no_sleep;
    self->run = avr->run;
    self->external_interrupts = (avr_extint_t *)mcu_module(self, "extint");
    self->watchdog = (avr_watchdog_t *)mcu_module(self, "watchdog");
    for (avr_io_t *module = avr->io_port; module; module = module->next)
        if (strcmp(module->kind, "timer") == 0 && ((avr_timer_t *)module)->name == '4')
            self->pwm_timer = (avr_timer_t *)module;
        else if (strcmp(module->kind, "timer") == 0 && ((avr_timer_t *)module)->name == '3')
            self->idle_timer = (avr_timer_t *)module;

    self->eeprom = (avr_eeprom_t *)mcu_module(self, "eeprom");
    if ((eeprom_path && !map_eeprom(self, eeprom_path, error, error_size)) ||
        !elf_image_load(elf_path, avr->flash, avr->flashend + 1, self->eeprom->eeprom, self->eeprom->size, error,
                        error_size)) {
        mcu_close(self);
        return false;
    }

    mend_interrupt_flags(avr, &self->external_interrupts->eint[0].vector);
    for (avr_io_t *module = avr->io_port; module; module = module->next)
        if (strcmp(module->kind, "timer") == 0)
            mend_interrupt_flags(avr, &((avr_timer_t *)module)->overflow);
    mend_eeprom(self);
    avr_register_io_write(avr, avr->reset_flags.porf.reg, write_reset_flags, self);

    // At the end of the chain, unlike avr_register_io: behind the modules' own resets.
    self->reset_hook = (avr_io_t){.kind = "virtual board", .avr = avr, .reset = after_reset};
    avr_io_t *last = avr->io_port;
    while (last->next)
        last = last->next;
    last->next = &self->reset_hook;
    return true;
}

void mcu_close(mcu *self)
{
    if (!self->avr)
        return;
    if (self->own_eeprom) {
        munmap(self->eeprom->eeprom, self->eeprom->size);
        self->eeprom->eeprom = self->own_eeprom;  // for simavr to free
    }
    free(self->elf_path);
    avr_terminate(self->avr);
    free(self->avr);
    self->avr = NULL;
}

static avr_cycle_count_t stop_here(avr_t *avr, avr_cycle_count_t when, void *param)
{
    (void)avr;
    (void)when;
    (void)param;
    return 0;
}

// Up to the next timer, which may let go of the held core.
static void pass_time(mcu *self, uint64_t cycle)
{
    avr_t *avr = self->avr;
    avr_cycle_count_t next = avr_cycle_timer_process(avr);
    if (self->held && avr->cycle < cycle)
        avr->cycle += next < cycle - avr->cycle ? next : cycle - avr->cycle;
}

bool mcu_run_until(mcu *self, uint64_t cycle)
{
    avr_t *avr = self->avr;
    if (avr->cycle < cycle)  // a sleeping core jumps from timer to timer: this one bounds the jump
        avr_cycle_timer_register(avr, cycle - avr->cycle, stop_here, self);
    while (avr->cycle < cycle) {
        if (self->held && avr->run == self->run) {
            pass_time(self, cycle);
            continue;
        }
        int state = avr_run(avr);
        if (state == cpu_Done || state == cpu_Crashed || state == cpu_Stopped)
            return false;
    }
    return true;
}

// ----------------------------------------------------------------------------------- pins

mcu_pin mcu_input_pin(const mcu *self, char port, uint8_t bit)
{
    mcu_pin pin = {mcu_port(self, port), bit};
    assert(pin.port); // the ATmega2560 has all that are asked for
    pin.port->external.pull_mask |= (uint8_t)(1u << bit);
    return pin;
}

void mcu_drive(mcu_pin pin, bool level)
{
    // simavr puts a pulled-up or "external" level on the pin again at every write to the port: keep it true.
    uint8_t mask = (uint8_t)(1u << pin.bit);
    pin.port->external.pull_value =
        (uint8_t)(level ? pin.port->external.pull_value | mask : pin.port->external.pull_value & ~mask);
    avr_raise_irq(pin.port->io.irq + pin.bit, level);
}

void mcu_drive_again(mcu_pin pin)
{
    avr_irq_t *irq = pin.port->io.irq + pin.bit;
    irq->flags |= IRQ_FLAG_INIT;  // pass the filter of unchanged levels
    avr_raise_irq(irq, irq->value);
}

void mcu_watch_pin(const mcu *self, char port, uint8_t bit, avr_irq_notify_t changed, void *context)
{
    mcu_pin pin = mcu_input_pin(self, port, bit);
    mcu_drive(pin, true);
    avr_irq_register_notify(pin.port->io.irq + bit, changed, context);
}

bool mcu_output(const mcu *self, char port, uint8_t bit)
{
    const avr_ioport_t *of = mcu_port(self, port);
    const uint8_t *data = self->avr->data;
    return (data[of->r_ddr] & data[of->r_port]) >> bit & 1;
}

static unsigned timer_register(const mcu *self, avr_io_addr_t low, avr_io_addr_t high)
{
    return self->avr->data[low] | self->avr->data[high] << 8;
}

double mcu_pwm_duty(const mcu *self, char port, uint8_t bit)
{
    avr_t *avr = self->avr;
    const avr_timer_t *timer = self->pwm_timer;
    const avr_timer_comp_t *compare = &timer->comp[0];
    if (!(avr->data[mcu_port(self, port)->r_ddr] >> bit & 1))
        return 0.0;
    if (avr_regbit_get(avr, compare->com) != 2)  // set at the bottom, cleared behind the match
        return mcu_output(self, port, bit);
    unsigned top = timer_register(self, timer->r_icr, timer->r_icrh);
    unsigned match = timer_register(self, compare->r_ocr, compare->r_ocrh);
    return match < top ? (match + 1.0) / (top + 1.0) : 1.0;
}
