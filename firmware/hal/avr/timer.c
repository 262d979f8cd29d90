// SPDX-License-Identifier: Apache-2.0
//
// Timer 1 runs freely at 2 MHz: it is the time base, and its compare unit A the sample timer.
#include <avr/interrupt.h>
#include <avr/io.h>

#include "board_protocol.h"
#include "hal.h"
#include "parts.h"

#define PRESCALER 8
_Static_assert(F_CPU / PRESCALER == BOARD_TICK_HZ, "choose another prescaler");

static volatile uint32_t overflows;

static struct {
    hal_tick_handler *handler;
    void *context;
    uint64_t next;
    uint32_t period;
    // The 16-bit compare matches once in 65 536 ticks: matches to let pass before the one meant.
    uint16_t matches_to_skip;
    uint16_t skip_a_period;
} sample_timer;

void timer_init(void)
{
    TCCR1A = 0;
    TCCR1B = _BV(CS11);
    TIMSK1 = _BV(TOIE1);
}

ISR(TIMER1_OVF_vect)
{
    overflows++;
}

uint32_t hal_beat(void)
{
    uint8_t state = hal_lock();
    uint32_t beats = overflows; // one every 33 ms
    hal_unlock(state);
    return beats;
}

uint64_t hal_time(void)
{
    uint8_t state = hal_lock();
    uint16_t low = TCNT1;
    uint32_t high = overflows;
    // An overflow that its handler has not counted yet; only if it came before TCNT1 was read.
    if ((TIFR1 & _BV(TOV1)) != 0 && low < 0x8000)
        high++;
    hal_unlock(state);
    return (uint64_t)high << 16 | low;
}

void hal_sample_timer_start(uint64_t first, uint32_t period, hal_tick_handler *handler,
                            void *context)
{
    uint8_t state = hal_lock();
    sample_timer.handler = handler;
    sample_timer.context = context;
    sample_timer.next = first;
    sample_timer.period = period;
    sample_timer.matches_to_skip = (uint16_t)((first - hal_time() - 1) >> 16);
    sample_timer.skip_a_period = (uint16_t)((period - 1) >> 16);
    OCR1A = (uint16_t)first;
    TIFR1 = _BV(OCF1A); // forget matches of the past
    TIMSK1 |= _BV(OCIE1A);
    hal_unlock(state);
}

void hal_sample_timer_stop(void)
{
    uint8_t state = hal_lock();
    TIMSK1 &= (uint8_t)~_BV(OCIE1A);
    hal_unlock(state);
}

ISR(TIMER1_COMPA_vect)
{
    if (sample_timer.matches_to_skip > 0) {
        sample_timer.matches_to_skip--;
        return;
    }
    sample_timer.handler(sample_timer.context, sample_timer.next);
    sample_timer.next += sample_timer.period;
    sample_timer.matches_to_skip = sample_timer.skip_a_period;
    OCR1A = (uint16_t)sample_timer.next;
}
