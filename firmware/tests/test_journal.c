// SPDX-License-Identifier: Apache-2.0
//
// The second port's EEPROM on a model of flash: words are written once after an erasure, and the
// power may go at any of these, done by half.
#include "check.h"

#include <stdbool.h>
#include <string.h>

#include "flash.h"
#include "journal.h"

#define NEVER UINT32_MAX
#define USED 300    // bytes in use
#define CHANGED 60  // of them written while the power goes

static uint32_t flash[FLASH_PAGES][FLASH_PAGE_WORDS];
static uint32_t actions_left; // until the power goes
static uint32_t torn_mask;    // bits of a word that are programmed nevertheless
static uint32_t erasures;
static jmp_buf power_gone;

uint32_t flash_word(uint8_t page, uint32_t index)
{
    return flash[page][index];
}

static bool is_last_action(void)
{
    return actions_left != NEVER && actions_left-- == 0;
}

void flash_erase(uint8_t page)
{
    erasures++;
    bool last = is_last_action();
    for (uint32_t i = 0; i < FLASH_PAGE_WORDS; i += last ? 2 : 1)
        flash[page][i] = FLASH_ERASED;
    if (last)
        longjmp(power_gone, 1);
}

void flash_program(uint8_t page, uint32_t index, uint32_t word)
{
    assert_true(index < FLASH_PAGE_WORDS);
    assert_true(flash[page][index] == FLASH_ERASED);
    bool last = is_last_action();
    flash[page][index] = last ? word | ~torn_mask : word;
    if (last)
        longjmp(power_gone, 1);
}

static void start_on_new_chip(void)
{
    memset(flash, 0xFF, sizeof flash);
    actions_left = NEVER;
    erasures = 0;
    journal_init();
}

static void holds_what_was_written_over_many_pages_and_resets(void **state)
{
    (void)state;
    static uint8_t expected[JOURNAL_SIZE], found[JOURNAL_SIZE];
    memset(expected, 0xFF, sizeof expected);
    start_on_new_chip();
    uint32_t random = 1;
    for (int i = 0; i < 8000; i++) {
        uint8_t bytes[8];
        uint8_t count = (uint8_t)(1 + next_random(&random) % sizeof bytes);
        uint16_t address = (uint16_t)(next_random(&random) % (JOURNAL_SIZE - sizeof bytes));
        for (uint8_t k = 0; k < count; k++)
            bytes[k] = (uint8_t)next_random(&random);
        journal_write(address, bytes, count);
        memcpy(expected + address, bytes, count);
        if (i % 97 != 0)
            continue;
        journal_init();
        for (uint16_t at = 0; at < JOURNAL_SIZE; at += 128)
            journal_read(at, found + at, 128);
        assert_memory_equal(found, expected, JOURNAL_SIZE);
    }
    assert_true(erasures >= 4); // both pages were made anew twice
}

static void an_equal_byte_takes_no_room(void **state)
{
    (void)state;
    start_on_new_chip();
    const uint8_t byte = 7;
    journal_write(3, &byte, 1);
    uint32_t before = flash_word(0, 2);
    for (uint32_t i = 0; i < 2 * FLASH_PAGE_WORDS; i++)
        journal_write(3, &byte, 1);
    assert_int_equal(before, FLASH_ERASED);
    assert_int_equal(flash_word(0, 2), FLASH_ERASED);
    assert_int_equal(erasures, 0);
}

// Returns whether all was written before the power went.
static bool write_until_power_goes(const uint8_t *bytes, uint32_t actions)
{
    actions_left = actions;
    if (setjmp(power_gone) != 0)
        return false;
    journal_write(0, bytes, CHANGED);
    return true;
}

// A page has its header and 4095 records. With `writes` records before, the page fills up among the
// bytes that are written while the power goes: at every word and erasure of the change of pages.
static void check_power_loss(uint32_t writes)
{
    static const uint32_t torn_masks[] = {0, 0x0000FFFF, 0xFFFF0000, 0x00FF00FF, UINT32_MAX};
    static uint32_t full[FLASH_PAGES][FLASH_PAGE_WORDS];
    static uint8_t old[USED];
    uint8_t new[CHANGED], found[USED];
    start_on_new_chip();
    memset(old, 0xFF, sizeof old);
    for (uint32_t i = 0; i < writes; i++) {
        uint16_t address = (uint16_t)(i % USED);
        old[address]--;
        journal_write(address, old + address, 1);
    }
    memcpy(full, flash, sizeof flash);
    for (int i = 0; i < CHANGED; i++)
        new[i] = (uint8_t)(old[i] ^ 0x5A);
    for (size_t tear = 0; tear < sizeof torn_masks / sizeof *torn_masks; tear++) {
        torn_mask = torn_masks[tear];
        bool complete = false;
        uint32_t actions = 0;
        for (; !complete; actions++) {
            memcpy(flash, full, sizeof flash);
            actions_left = NEVER;
            journal_init();
            complete = write_until_power_goes(new, actions);
            actions_left = NEVER;
            journal_init();
            journal_read(0, found, 150);
            journal_read(150, found + 150, 150);
            for (int i = 0; i < CHANGED; i++)
                assert_true(found[i] == new[i] || (!complete && found[i] == old[i]));
            assert_memory_equal(found + CHANGED, old + CHANGED, USED - CHANGED);
        }
        assert_true(actions > USED); // the change of pages was among them
    }
}

static void power_loss_at_the_first_change_of_pages_leaves_old_or_new(void **state)
{
    (void)state;
    check_power_loss(FLASH_PAGE_WORDS - 1 - CHANGED / 2);
}

// The page that is taken over into has been in use before.
static void power_loss_at_the_second_change_of_pages_leaves_old_or_new(void **state)
{
    (void)state;
    check_power_loss(2 * (FLASH_PAGE_WORDS - 1) - USED - CHANGED / 2);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(holds_what_was_written_over_many_pages_and_resets),
        cmocka_unit_test(an_equal_byte_takes_no_room),
        cmocka_unit_test(power_loss_at_the_first_change_of_pages_leaves_old_or_new),
        cmocka_unit_test(power_loss_at_the_second_change_of_pages_leaves_old_or_new),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
