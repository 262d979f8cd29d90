// SPDX-License-Identifier: Apache-2.0
//
// Two pages of flash that the program may write: the chip's sectors 1 and 2. A word is written once
// after its page was erased; erased words are all ones.
#ifndef FLASH_H
#define FLASH_H

#include <stdint.h>

#define FLASH_PAGES 2u
#define FLASH_PAGE_WORDS 4096u
#define FLASH_ERASED UINT32_MAX

uint32_t flash_word(uint8_t page, uint32_t index);

// Takes 0.25 s, 0.5 s at most, in which the processor stands still, interrupts and all.
void flash_erase(uint8_t page);

// Takes 16 µs, 100 µs at most, likewise.
void flash_program(uint8_t page, uint32_t index, uint32_t word);

#endif
