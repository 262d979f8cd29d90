// SPDX-License-Identifier: Apache-2.0
#include "journal.h"

#include <stdbool.h>
#include <string.h>

#include "flash.h"
#include "hal.h"

#define HEADER UINT32_C(0x54574A00) // and the page's generation in the lowest byte
#define HEADER_MASK UINT32_C(0xFFFFFF00)

static struct {
    uint8_t bytes[JOURNAL_SIZE]; // as the journal has them
    uint8_t page;                // in use
    uint8_t generation;
    uint32_t end; // index of the word behind the last record
} journal;

static uint32_t record_of(uint16_t address, uint8_t value)
{
    const uint8_t contents[] = {(uint8_t)address, (uint8_t)(address >> 8), value};
    uint8_t check = hal_crc8_ccitt(0, contents, sizeof contents);
    return (uint32_t)check << 24 | (uint32_t)value << 16 | address;
}

static bool is_in_use(uint8_t page)
{
    return (flash_word(page, 0) & HEADER_MASK) == HEADER;
}

static bool is_blank(uint8_t page)
{
    for (uint32_t i = 0; i < FLASH_PAGE_WORDS; i++) {
        if (flash_word(page, i) != FLASH_ERASED)
            return false;
    }
    return true;
}

// Makes the page the one in use.
static void take_over(uint8_t page, uint8_t generation)
{
    if (!is_blank(page))
        flash_erase(page);
    journal.end = 1;
    for (uint16_t address = 0; address < JOURNAL_SIZE; address++) {
        if (journal.bytes[address] != 0xFF)
            flash_program(page, journal.end++, record_of(address, journal.bytes[address]));
    }
    flash_program(page, 0, HEADER | generation);
    journal.page = page;
    journal.generation = generation;
}

// The later of the two, should the power have gone before the older one was erased.
static bool find_page(void)
{
    bool first = is_in_use(0), second = is_in_use(1);
    if (!first && !second)
        return false;
    uint8_t generations[] = {(uint8_t)flash_word(0, 0), (uint8_t)flash_word(1, 0)};
    bool second_is_later = (int8_t)(generations[1] - generations[0]) > 0;
    journal.page = second && (!first || second_is_later);
    journal.generation = generations[journal.page];
    return true;
}

void journal_init(void)
{
    memset(journal.bytes, 0xFF, sizeof journal.bytes);
    if (!find_page()) {
        take_over(0, 0);
        return;
    }
    journal.end = 1;
    for (uint32_t i = 1; i < FLASH_PAGE_WORDS; i++) {
        uint32_t record = flash_word(journal.page, i);
        if (record == FLASH_ERASED)
            continue;
        journal.end = i + 1;
        uint16_t address = (uint16_t)record;
        uint8_t value = (uint8_t)(record >> 16);
        if (address < JOURNAL_SIZE && record == record_of(address, value))
            journal.bytes[address] = value;
    }
    uint8_t other = (uint8_t)(1 - journal.page);
    if (!is_blank(other))
        flash_erase(other);
}

void journal_read(uint16_t address, uint8_t *bytes, uint8_t count)
{
    memcpy(bytes, journal.bytes + address, count);
}

static void append(uint16_t address, uint8_t value)
{
    if (journal.end == FLASH_PAGE_WORDS)
        take_over((uint8_t)(1 - journal.page), (uint8_t)(journal.generation + 1));
    uint32_t record = record_of(address, value);
    flash_program(journal.page, journal.end, record);
    if (flash_word(journal.page, journal.end) == record)
        journal.bytes[address] = value;
    journal.end++;
}

void journal_write(uint16_t address, const uint8_t *bytes, uint8_t count)
{
    for (uint8_t i = 0; i < count; i++) {
        if (journal.bytes[address + i] != bytes[i])
            append((uint16_t)(address + i), bytes[i]);
    }
}
