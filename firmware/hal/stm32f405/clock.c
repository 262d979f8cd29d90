// SPDX-License-Identifier: Apache-2.0
#include "clock.h"

#include <stdbool.h>

#include "parts.h"
#include "registers.h"

#define HSE_HZ 8000000u  // the crystal: another one is to be stated here
#define HSI_HZ 16000000u // the chip's own oscillator, ±1 %
#define PLL_INPUT_HZ 2000000u
#define PLL_HZ (2 * CORE_HZ)
_Static_assert(HSE_HZ % PLL_INPUT_HZ == 0, "the crystal needs another PLL input");

#define WAIT_STATES 4u // of the flash at 120 to 150 MHz and 2.7 to 3.6 V

// No wait is endless: without its crystal the board runs on the chip's oscillator, and the host sees
// how far off it is. An emulator has no clock tree at all.
#define PATIENCE 100000u

static bool comes_up(const volatile uint32_t *status, uint32_t mask, uint32_t wanted)
{
    for (uint32_t i = 0; i < PATIENCE; i++) {
        if ((*status & mask) == wanted)
            return true;
    }
    return false;
}

void clock_init(void)
{
    RCC->CR |= RCC_CR_HSEON;
    bool crystal = comes_up(&RCC->CR, RCC_CR_HSERDY, RCC_CR_HSERDY);
    uint32_t divider = (crystal ? HSE_HZ : HSI_HZ) / PLL_INPUT_HZ;
    RCC->PLLCFGR = divider << RCC_PLLCFGR_PLLM_SHIFT |
                   (PLL_HZ / PLL_INPUT_HZ) << RCC_PLLCFGR_PLLN_SHIFT | RCC_PLLCFGR_PLLP_BY_2 |
                   (crystal ? RCC_PLLCFGR_PLLSRC_HSE : 0u) | 8u << RCC_PLLCFGR_PLLQ_SHIFT;
    RCC->CR |= RCC_CR_PLLON;
    comes_up(&RCC->CR, RCC_CR_PLLRDY, RCC_CR_PLLRDY);
    FLASH->ACR = FLASH_ACR_PRFTEN | FLASH_ACR_ICEN | FLASH_ACR_DCEN | WAIT_STATES;
    RCC->CFGR = RCC_CFGR_PPRE1_BY_4 | RCC_CFGR_PPRE2_BY_2 | RCC_CFGR_SW_PLL;
    comes_up(&RCC->CFGR, RCC_CFGR_SWS_MASK, RCC_CFGR_SWS_PLL);

    RCC->AHB1ENR |= RCC_AHB1ENR_GPIOA | RCC_AHB1ENR_GPIOB | RCC_AHB1ENR_GPIOC;
    RCC->APB1ENR |= RCC_APB1ENR_TIM3 | RCC_APB1ENR_TIM5;
    RCC->APB2ENR |= RCC_APB2ENR_USART1 | RCC_APB2ENR_SPI1 | RCC_APB2ENR_SYSCFG;
    (void)RCC->APB2ENR; // a block may be touched two clocks after it was switched on
}
