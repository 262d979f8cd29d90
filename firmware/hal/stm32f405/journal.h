// SPDX-License-Identifier: Apache-2.0
//
// Bytes that can be written one by one, kept in flash that can only be erased by the page: each byte
// that changes is a record behind the others in the page in use. When that page is full, the other
// one takes over what is valid. No register: the tests run it on a page of memory.
//
// A page starts with a header word, written last, so that a page whose making was cut short is none.
// A record holds the byte's address, its value and a checksum, for the same reason.
#ifndef JOURNAL_H
#define JOURNAL_H

#include <stdint.h>

#define JOURNAL_SIZE 1024u

// Reads what is there, and erases the page that is not in use if it is not blank.
void journal_init(void);

void journal_read(uint16_t address, uint8_t *bytes, uint8_t count);

// Writes the bytes that differ; those that flash did not take keep their old value.
void journal_write(uint16_t address, const uint8_t *bytes, uint8_t count);

#endif
