// SPDX-License-Identifier: Apache-2.0
//
// Timer 5 runs freely at 2 MHz over 32 bits: it is the time base, and its compare unit 1 the sample
// timer. SysTick is the beat.
#include "board_protocol.h"
#include "clock.h"
#include "hal.h"
#include "parts.h"
#include "registers.h"

#define PRESCALER (APB1_TIMER_HZ / BOARD_TICK_HZ)
_Static_assert(PRESCALER * BOARD_TICK_HZ == APB1_TIMER_HZ, "choose another clock");

#define BEAT_HZ 30u
#define SYSTICK_HZ (CORE_HZ / 8)

static volatile uint32_t overflows;
static volatile uint32_t beats;

static struct {
    hal_tick_handler *handler;
    void *context;
    uint64_t next;
    uint32_t period;
} sample_timer;

void systick_handler(void);
void tim5_handler(void);

void timer_init(void)
{
    TIM5->CR1 = TIM_CR1_URS; // loading the prescaler is not an overflow
    TIM5->PSC = PRESCALER - 1;
    TIM5->ARR = UINT32_MAX;
    TIM5->EGR = TIM_EGR_UG;
    TIM5->SR = 0;
    TIM5->DIER = TIM_DIER_UIE;
    TIM5->CR1 = TIM_CR1_URS | TIM_CR1_CEN;
    interrupt_enable(IRQ_TIM5);

    SYSTICK->LOAD = SYSTICK_HZ / BEAT_HZ - 1;
    SYSTICK->VAL = 0;
    SYSTICK->CTRL = SYSTICK_CTRL_ENABLE | SYSTICK_CTRL_TICKINT; // HCLK / 8
}

void systick_handler(void)
{
    beats++;
}

uint32_t hal_beat(void)
{
    return beats;
}

void timer_wait(uint32_t ticks)
{
    uint32_t start = TIM5->CNT;
    while (TIM5->CNT - start <= ticks)
        ;
}

void hal_delay_ms(uint8_t milliseconds)
{
    timer_wait(milliseconds * (BOARD_TICK_HZ / 1000));
}

uint64_t hal_time(void)
{
    uint8_t state = hal_lock();
    uint32_t low = TIM5->CNT;
    uint32_t high = overflows;
    // An overflow that its handler has not counted yet; only if it came before CNT was read.
    if ((TIM5->SR & TIM_SR_UIF) != 0 && low < UINT32_MAX / 2)
        high++;
    hal_unlock(state);
    return (uint64_t)high << 32 | low;
}

void hal_sample_timer_start(uint64_t first, uint32_t period, hal_tick_handler *handler,
                            void *context)
{
    uint8_t state = hal_lock();
    sample_timer.handler = handler;
    sample_timer.context = context;
    sample_timer.next = first;
    sample_timer.period = period;
    TIM5->CCR1 = (uint32_t)first;
    TIM5->SR = ~TIM_SR_CC1IF; // forget matches of the past
    TIM5->DIER |= TIM_DIER_CC1IE;
    hal_unlock(state);
}

void hal_sample_timer_stop(void)
{
    uint8_t state = hal_lock();
    TIM5->DIER &= ~TIM_DIER_CC1IE;
    hal_unlock(state);
}

void tim5_handler(void)
{
    // Status bits are cleared by zeros; ones leave them alone.
    if ((TIM5->SR & TIM_SR_UIF) != 0) {
        TIM5->SR = ~TIM_SR_UIF;
        overflows++;
    }
    if ((TIM5->DIER & TIM_DIER_CC1IE) != 0 && (TIM5->SR & TIM_SR_CC1IF) != 0) {
        TIM5->SR = ~TIM_SR_CC1IF;
        sample_timer.handler(sample_timer.context, sample_timer.next);
        sample_timer.next += sample_timer.period;
        TIM5->CCR1 = (uint32_t)sample_timer.next;
    }
}
