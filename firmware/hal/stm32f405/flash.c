// SPDX-License-Identifier: Apache-2.0
#include "flash.h"

#include "board_protocol.h"
#include "parts.h"
#include "registers.h"

#define SECTOR_OF_PAGE_0 1u
#define STORAGE_ADDRESS 0x08004000u // STORAGE of the linker script
#define ERASURE_MS 1000u            // twice what it takes at most

static volatile uint32_t *address_of(uint8_t page, uint32_t index)
{
    return (volatile uint32_t *)STORAGE_ADDRESS + page * FLASH_PAGE_WORDS + index;
}

uint32_t flash_word(uint8_t page, uint32_t index)
{
    return *address_of(page, index);
}

static void unlock(uint32_t action)
{
    FLASH->KEYR = FLASH_KEY_1;
    FLASH->KEYR = FLASH_KEY_2;
    FLASH->SR = FLASH_SR_ERRORS;
    FLASH->CR = FLASH_CR_PSIZE_32 | action;
}

static void finish(void)
{
    while ((FLASH->SR & FLASH_SR_BSY) != 0)
        ;
    FLASH->CR = FLASH_CR_LOCK;
}

void flash_erase(uint8_t page)
{
    watchdog_grant(ERASURE_MS);
    unlock(FLASH_CR_SER | (SECTOR_OF_PAGE_0 + page) << FLASH_CR_SNB_SHIFT);
    FLASH->CR |= FLASH_CR_STRT;
    finish();
    // The data cache knows nothing of an erasure.
    FLASH->ACR &= ~FLASH_ACR_DCEN;
    FLASH->ACR |= FLASH_ACR_DCRST;
    FLASH->ACR &= ~FLASH_ACR_DCRST;
    FLASH->ACR |= FLASH_ACR_DCEN;
    watchdog_grant(BOARD_WATCHDOG_MS);
}

void flash_program(uint8_t page, uint32_t index, uint32_t word)
{
    unlock(FLASH_CR_PG);
    *address_of(page, index) = word;
    finish();
}
