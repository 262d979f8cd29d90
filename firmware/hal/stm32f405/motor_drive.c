// SPDX-License-Identifier: Apache-2.0
//
// Timer 3 makes the PWM on its channel 1. Once a period its interrupt looks at the emergency-stop loop,
// whatever holds the main loop up, and whether the main loop still leads the motor.
#include "board_protocol.h"
#include "clock.h"
#include "hal.h"
#include "parts.h"
#include "pins.h"

#define PERIOD (APB1_TIMER_HZ / BOARD_DRIVE_PWM_HZ)
#define FULL_DUTY 10000u

// The loop was open, however shortly, while the motor had power.
static volatile bool opened;
// For which the motor keeps its power without a word of the main loop.
static volatile uint32_t periods_left;

void tim3_handler(void);

static bool loop_closed(void)
{
    return !pin_is_high(DRIVE, EMERGENCY_STOP_PIN);
}

void motor_drive_cut(void)
{
    pin_set(DRIVE, DRIVE_ENABLE_PIN, false);
    pin_set(DRIVE_PWM, DRIVE_PWM_PIN, false);
    pin_output(DRIVE_PWM, DRIVE_PWM_PIN); // the port's, not the timer's
}

void motor_drive_init(void)
{
    motor_drive_cut();
    pin_output(DRIVE, DRIVE_ENABLE_PIN);
    pin_pull_up(DRIVE, EMERGENCY_STOP_PIN);
    TIM3->PSC = 0;
    TIM3->ARR = PERIOD - 1;
    TIM3->CCMR1 = TIM_CCMR1_OC1M_PWM_1 | TIM_CCMR1_OC1PE;
    TIM3->CCER = TIM_CCER_CC1E;
    TIM3->CR1 = TIM_CR1_CEN;
    interrupt_enable(IRQ_TIM3);
}

void hal_drive_on(uint16_t duty)
{
    TIM3->CCR1 = duty * PERIOD / FULL_DUTY; // taken over at the next period: no short pulse
    pin_alternate(DRIVE_PWM, DRIVE_PWM_PIN, DRIVE_PWM_FUNCTION);
    TIM3->DIER = TIM_DIER_UIE;
    uint8_t state = hal_lock();
    periods_left = BOARD_DRIVE_ALIVE_PERIODS;
    if (!opened)
        pin_set(DRIVE, DRIVE_ENABLE_PIN, true);
    hal_unlock(state);
}

void tim3_handler(void)
{
    TIM3->SR = ~TIM_SR_UIF;
    if (!loop_closed())
        opened = true;
    uint32_t left = periods_left;
    if (left > 0)
        periods_left = left - 1;
    if (opened || left == 0)
        pin_set(DRIVE, DRIVE_ENABLE_PIN, false);
}

void hal_drive_off(void)
{
    TIM3->DIER = 0;
    pin_set(DRIVE, DRIVE_ENABLE_PIN, false);
    opened = false;
    pin_output(DRIVE_PWM, DRIVE_PWM_PIN); // the port's again, low
    TIM3->CCR1 = 0;
    TIM3->EGR = TIM_EGR_UG; // at once
}

bool hal_emergency_stop_closed(void)
{
    return loop_closed() && !opened;
}
