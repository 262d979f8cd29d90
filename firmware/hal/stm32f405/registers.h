// SPDX-License-Identifier: Apache-2.0
//
// The registers that this implementation uses, with the names of ST's reference manual RM0090 and of
// Arm's Cortex-M4 manual. Only blocks and bits that are needed.
#ifndef REGISTERS_H
#define REGISTERS_H

#include <stdint.h>

#define BIT(n) (UINT32_C(1) << (n))

struct gpio {
    volatile uint32_t MODER, OTYPER, OSPEEDR, PUPDR, IDR, ODR, BSRR, LCKR, AFR[2];
};
#define GPIOA ((struct gpio *)0x40020000u)
#define GPIOB ((struct gpio *)0x40020400u)
#define GPIOC ((struct gpio *)0x40020800u)

struct rcc {
    volatile uint32_t CR, PLLCFGR, CFGR, CIR;
    volatile uint32_t AHB1RSTR, AHB2RSTR, AHB3RSTR, reserved_1, APB1RSTR, APB2RSTR, reserved_2[2];
    volatile uint32_t AHB1ENR, AHB2ENR, AHB3ENR, reserved_3, APB1ENR, APB2ENR, reserved_4[2];
    volatile uint32_t AHB1LPENR, AHB2LPENR, AHB3LPENR, reserved_5, APB1LPENR, APB2LPENR;
    volatile uint32_t reserved_6[2], BDCR, CSR;
};
#define RCC ((struct rcc *)0x40023800u)
#define RCC_CR_HSEON BIT(16)
#define RCC_CR_HSERDY BIT(17)
#define RCC_CR_PLLON BIT(24)
#define RCC_CR_PLLRDY BIT(25)
#define RCC_PLLCFGR_PLLM_SHIFT 0
#define RCC_PLLCFGR_PLLN_SHIFT 6
#define RCC_PLLCFGR_PLLP_BY_2 0u
#define RCC_PLLCFGR_PLLSRC_HSE BIT(22)
#define RCC_PLLCFGR_PLLQ_SHIFT 24
#define RCC_CFGR_SW_PLL 2u
#define RCC_CFGR_SWS_MASK (3u << 2)
#define RCC_CFGR_SWS_PLL (2u << 2)
#define RCC_CFGR_PPRE1_BY_4 (5u << 10)
#define RCC_CFGR_PPRE2_BY_2 (4u << 13)
#define RCC_AHB1ENR_GPIOA BIT(0)
#define RCC_AHB1ENR_GPIOB BIT(1)
#define RCC_AHB1ENR_GPIOC BIT(2)
#define RCC_APB1ENR_TIM3 BIT(1)
#define RCC_APB1ENR_TIM5 BIT(3)
#define RCC_APB2ENR_USART1 BIT(4)
#define RCC_APB2ENR_SPI1 BIT(12)
#define RCC_APB2ENR_SYSCFG BIT(14)
#define RCC_CSR_RMVF BIT(24)
#define RCC_CSR_BORRSTF BIT(25)
#define RCC_CSR_PINRSTF BIT(26)
#define RCC_CSR_PORRSTF BIT(27)
#define RCC_CSR_SFTRSTF BIT(28)
#define RCC_CSR_IWDGRSTF BIT(29)
#define RCC_CSR_WWDGRSTF BIT(30)

struct flash_interface {
    volatile uint32_t ACR, KEYR, OPTKEYR, SR, CR;
};
#define FLASH ((struct flash_interface *)0x40023C00u)
#define FLASH_ACR_PRFTEN BIT(8)
#define FLASH_ACR_ICEN BIT(9)
#define FLASH_ACR_DCEN BIT(10)
#define FLASH_ACR_DCRST BIT(12)
#define FLASH_KEY_1 0x45670123u
#define FLASH_KEY_2 0xCDEF89ABu
#define FLASH_SR_BSY BIT(16)
#define FLASH_SR_ERRORS 0xF2u // PGSERR, PGPERR, PGAERR, WRPERR, OPERR; cleared by ones
#define FLASH_CR_PG BIT(0)
#define FLASH_CR_SER BIT(1)
#define FLASH_CR_SNB_SHIFT 3
#define FLASH_CR_PSIZE_32 (2u << 8)
#define FLASH_CR_STRT BIT(16)
#define FLASH_CR_LOCK BIT(31)

struct usart {
    volatile uint32_t SR, DR, BRR, CR1, CR2, CR3, GTPR;
};
#define USART1 ((struct usart *)0x40011000u)
#define USART_SR_ORE BIT(3)
#define USART_SR_RXNE BIT(5)
#define USART_SR_TC BIT(6)
#define USART_SR_TXE BIT(7)
#define USART_CR1_RE BIT(2)
#define USART_CR1_TE BIT(3)
#define USART_CR1_RXNEIE BIT(5)
#define USART_CR1_TXEIE BIT(7)
#define USART_CR1_UE BIT(13)

struct spi {
    volatile uint32_t CR1, CR2, SR, DR;
};
#define SPI1 ((struct spi *)0x40013000u)
#define SPI_CR1_CPHA BIT(0)
#define SPI_CR1_CPOL BIT(1)
#define SPI_CR1_MSTR BIT(2)
#define SPI_CR1_BR_BY_16 (3u << 3)
#define SPI_CR1_SPE BIT(6)
#define SPI_CR1_SSI BIT(8)
#define SPI_CR1_SSM BIT(9)
#define SPI_SR_RXNE BIT(0)

struct timer {
    volatile uint32_t CR1, CR2, SMCR, DIER, SR, EGR, CCMR1, CCMR2, CCER, CNT, PSC, ARR, RCR, CCR1;
};
#define TIM3 ((struct timer *)0x40000400u)
#define TIM5 ((struct timer *)0x40000C00u)
#define TIM_CR1_CEN BIT(0)
#define TIM_CR1_URS BIT(2)
#define TIM_DIER_UIE BIT(0)
#define TIM_DIER_CC1IE BIT(1)
#define TIM_SR_UIF BIT(0)
#define TIM_SR_CC1IF BIT(1)
#define TIM_EGR_UG BIT(0)
#define TIM_CCMR1_OC1PE BIT(3)
#define TIM_CCMR1_OC1M_PWM_1 (6u << 4)
#define TIM_CCER_CC1E BIT(0)

struct exti {
    volatile uint32_t IMR, EMR, RTSR, FTSR, SWIER, PR;
};
#define EXTI ((struct exti *)0x40013C00u)

struct syscfg {
    volatile uint32_t MEMRMP, PMC, EXTICR[4];
};
#define SYSCFG ((struct syscfg *)0x40013800u)
#define SYSCFG_EXTICR_PORT_C 2u

struct iwdg {
    volatile uint32_t KR, PR, RLR, SR;
};
#define IWDG ((struct iwdg *)0x40003000u)
#define IWDG_KR_UNLOCK 0x5555u
#define IWDG_KR_RELOAD 0xAAAAu
#define IWDG_KR_START 0xCCCCu
#define IWDG_PR_BY_16 2u
#define IWDG_RLR_MAXIMUM 0xFFFu

struct systick {
    volatile uint32_t CTRL, LOAD, VAL, CALIB;
};
#define SYSTICK ((struct systick *)0xE000E010u)
#define SYSTICK_CTRL_ENABLE BIT(0)
#define SYSTICK_CTRL_TICKINT BIT(1)

struct nvic {
    volatile uint32_t ISER[8], reserved_1[24], ICER[8], reserved_2[24], ISPR[8];
};
#define NVIC ((struct nvic *)0xE000E100u)

#define SCB_AIRCR (*(volatile uint32_t *)0xE000ED0Cu)
#define SCB_AIRCR_VECTKEY (0x05FAu << 16)
#define SCB_AIRCR_SYSRESETREQ BIT(2)

// Numbers of the interrupts in use.
enum interrupt {
    IRQ_EXTI0 = 6,
    IRQ_EXTI1 = 7,
    IRQ_EXTI2 = 8,
    IRQ_EXTI3 = 9,
    IRQ_TIM3 = 29,
    IRQ_USART1 = 37,
    IRQ_TIM5 = 50,
    IRQ_COUNT = 82,
};

static inline void interrupt_enable(enum interrupt number)
{
    NVIC->ISER[number / 32] = BIT(number % 32);
}

// As if the device had asked for it.
static inline void interrupt_pend(enum interrupt number)
{
    NVIC->ISPR[number / 32] = BIT(number % 32);
}

#endif
