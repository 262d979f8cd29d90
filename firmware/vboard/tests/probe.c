// SPDX-License-Identifier: GPL-3.0-or-later
//
// A firmware for the virtual board's own tests: it does to the hardware what the host tells it, byte by byte,
// so that the tests in Python can see every pin and register through it.
//
// Requests (250 kbaud), answers in brackets:
//   e N bytes…   echo [bytes]
//   s N bytes…   SPI: CS low, exchange N bytes, CS high [bytes received]
//   c L          CS to level L; then `x N bytes…` exchanges without moving CS [bytes]
//   y L          SYNC to level L
//   t N          SYNC pulse, then N ≤ 16 times: wait for RDY̅, note ticks, read DATA, 5 bytes
//                [ticks u32 at which SYNC rose, N × (ticks u32, 5 bytes)];
//                0xFFFFFFFF and zeros if RDY̅ does not come within 0.5 s
//   n            encoder counts [crank i32, carriage i32, illegal steps u16]
//   k            ticks of 0.5 µs since reset [u32]
//   z            ticks at the last edge of the crank encoder [u32]
//   v            RDY̅ level [u8]
//   i            interrupts of RDY̅ (falling edge, INT4 always on) [u16]
//   f            flag registers, see flags() [5 bytes]
//   d            changes pull-ups of port D, as a firmware may [u8 0]
//   w            stops, so that the watchdog (16 ms) resets
// After reset: 'B', MCUSR, a counter in .noinit.
#define F_CPU 16000000UL
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/wdt.h>
#include <stdbool.h>
#include <stdint.h>
#include <util/delay.h>

static uint8_t reset_flags __attribute__((section(".noinit")));
static uint8_t boot_count __attribute__((section(".noinit")));

// The watchdog runs on after its reset: off before anything else.
void early(void) __attribute__((naked, used, section(".init3")));
void early(void)
{
    reset_flags = MCUSR;
    MCUSR = 0;
    wdt_disable();
}

static volatile uint16_t tick_overflows, ready_edges;
static volatile int32_t counts[2];
static volatile uint16_t illegal;
static volatile uint32_t last_crank_edge;
static volatile uint8_t received[256], received_head;
static uint8_t received_tail;

ISR(USART0_RX_vect)
{
    received[received_head++] = UDR0;
}

ISR(TIMER1_OVF_vect)
{
    tick_overflows++;
}

ISR(INT4_vect)
{
    ready_edges++;
}

static void decode(uint8_t which)
{
    static uint8_t states[2];
    static const int8_t steps[16] = {0, 1, -1, 2, -1, 0, 2, 1, 1, 2, 0, -1, 2, -1, 1, 0};
    uint8_t state = PIND >> (2 * which) & 3;
    int8_t step = steps[states[which] << 2 | state];
    states[which] = state;
    if (step == 2)
        illegal++;
    else
        counts[which] += step;
}

static uint32_t ticks(void)
{
    uint8_t sreg = SREG;
    cli();
    uint16_t low = TCNT1;
    uint16_t high = tick_overflows;
    if (TIFR1 & _BV(TOV1) && low < 0x8000)
        high++;
    SREG = sreg;
    return (uint32_t)high << 16 | low;
}

ISR(INT0_vect)
{
    last_crank_edge = ticks();
    decode(0);
}
ISR(INT1_vect, ISR_ALIASOF(INT0_vect));
ISR(INT2_vect)
{
    decode(1);
}
ISR(INT3_vect, ISR_ALIASOF(INT2_vect));

static void send(uint8_t byte)
{
    while (!(UCSR0A & _BV(UDRE0)))
        ;
    UDR0 = byte;
}

static void send_u32(uint32_t value)
{
    for (uint8_t i = 0; i < 4; i++)
        send((uint8_t)(value >> 8 * i));
}

static uint8_t receive(void)
{
    while (received_tail == received_head)
        ;
    return received[received_tail++];
}

static uint8_t exchange(uint8_t byte)
{
    SPDR = byte;
    while (!(SPSR & _BV(SPIF)))
        ;
    return SPDR;
}

static void set_cs(bool level)
{
    if (level)
        PORTB |= _BV(PB0);
    else
        PORTB &= (uint8_t)~_BV(PB0);
}

static void set_sync(bool level)
{
    if (level)
        PORTL |= _BV(PL0);
    else
        PORTL &= (uint8_t)~_BV(PL0);
}

static void exchange_and_answer(uint8_t count)
{
    uint8_t answer[32];
    for (uint8_t i = 0; i < count; i++)
        answer[i] = receive();
    for (uint8_t i = 0; i < count; i++)
        answer[i] = exchange(answer[i]);
    for (uint8_t i = 0; i < count; i++)
        send(answer[i]);
}

static void time_conversions(uint8_t count)
{
    uint32_t instants[16] = {0};
    uint8_t data[16][5] = {{0}};
    set_sync(false);
    _delay_us(20);
    set_cs(false);
    set_sync(true);
    uint32_t start = ticks();
    for (uint8_t i = 0; i < count; i++) {
        uint32_t waited = 0;
        do
            waited = ticks() - start;
        while (PINE & _BV(PE4) && waited < 1000000);
        instants[i] = start + waited;
        if (PINE & _BV(PE4)) {
            instants[i] = 0xFFFFFFFF;
            continue;
        }
        exchange(0x42);
        for (uint8_t j = 0; j < 5; j++)
            data[i][j] = exchange(0);
    }
    set_cs(true);
    send_u32(start);
    for (uint8_t i = 0; i < count; i++) {
        send_u32(instants[i]);
        for (uint8_t j = 0; j < 5; j++)
            send(data[i][j]);
    }
}

// What the flag registers do; all interrupts are off meanwhile. Timer 3 is free for this.
static void flags(void)
{
    cli();
    TCCR3B = _BV(CS30);
    OCR3A = 100;
    OCR3B = 200;
    _delay_us(50);
    send(TIFR3 & (_BV(OCF3A) | _BV(OCF3B)));  // both set
    TIFR3 = _BV(OCF3A);
    send(TIFR3 & (_BV(OCF3A) | _BV(OCF3B)));  // B remains
    TCCR3B = 0;
    EIMSK &= (uint8_t)~_BV(INT4);
    uint16_t before = ready_edges;
    set_cs(false);
    exchange(0x45);  // reading the ID moves the RDY̅ wire
    exchange(0);
    set_cs(true);
    send(EIFR & _BV(INTF4));
    sei();
    EIMSK |= _BV(INT4);  // the flag set meanwhile strikes now
    _delay_us(5);
    send((uint8_t)(ready_edges - before));
    cli();
    EIMSK &= (uint8_t)~_BV(INT4);
    set_cs(false);
    exchange(0x45);
    exchange(0);
    set_cs(true);
    EIFR = _BV(INTF4);  // cleared in time
    before = ready_edges;
    sei();
    EIMSK |= _BV(INT4);
    _delay_us(5);
    send((uint8_t)(ready_edges - before));
}

int main(void)
{
    if (reset_flags & _BV(PORF))
        boot_count = 0;
    boot_count++;
    UBRR0 = 3;
    UCSR0B = _BV(RXEN0) | _BV(TXEN0) | _BV(RXCIE0);
    TCCR1B = _BV(CS11);
    TIMSK1 = _BV(TOIE1);
    PORTB = _BV(PB0);
    DDRB = _BV(PB0) | _BV(PB1) | _BV(PB2);
    PORTL = _BV(PL0);
    DDRL = _BV(PL0);
    SPCR = _BV(SPE) | _BV(MSTR) | _BV(CPOL) | _BV(CPHA);
    EICRA = _BV(ISC00) | _BV(ISC10) | _BV(ISC20) | _BV(ISC30);
    EICRB = _BV(ISC41);
    EIFR = 0xFF;
    EIMSK = 0x1F;
    sei();
    send('B');
    send(reset_flags);
    send(boot_count);

    for (;;) {
        switch (receive()) {
        case 'e':
            for (uint8_t count = receive(); count; count--)
                send(receive());
            break;
        case 's': {
            uint8_t count = receive();
            set_cs(false);
            exchange_and_answer(count);
            set_cs(true);
            break;
        }
        case 'c':
            set_cs(receive());
            break;
        case 'x':
            exchange_and_answer(receive());
            break;
        case 'y':
            set_sync(receive());
            break;
        case 't':
            time_conversions(receive());
            break;
        case 'n':
            cli();
            {
                int32_t crank = counts[0], carriage = counts[1];
                uint16_t steps = illegal;
                sei();
                send_u32((uint32_t)crank);
                send_u32((uint32_t)carriage);
                send((uint8_t)steps);
                send((uint8_t)(steps >> 8));
            }
            break;
        case 'k':
            send_u32(ticks());
            break;
        case 'z':
            cli();
            {
                uint32_t edge = last_crank_edge;
                sei();
                send_u32(edge);
            }
            break;
        case 'v':
            send(PINE >> PE4 & 1);
            break;
        case 'i':
            cli();
            {
                uint16_t edges = ready_edges;
                sei();
                send((uint8_t)edges);
                send((uint8_t)(edges >> 8));
            }
            break;
        case 'f':
            flags();
            break;
        case 'd':
            PORTD ^= 0x0F;
            send(0);
            break;
        case 'w':
            wdt_enable(WDTO_15MS);
            for (;;)
                ;
        }
    }
}
