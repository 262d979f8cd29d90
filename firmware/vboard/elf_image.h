// SPDX-License-Identifier: GPL-3.0-or-later
//
// Reads a firmware ELF by its program headers. (libsimavr's own loader looks at section names and misses what
// lies at 0x20000 and above.)
#ifndef VBOARD_ELF_IMAGE_H
#define VBOARD_ELF_IMAGE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

// Copies every loaded segment to `flash` or, from the linker's address 0x810000, to `eeprom`.
// False with one line in `error` if the file is not an AVR executable or does not fit.
bool elf_image_load(const char *path, uint8_t *flash, size_t flash_size, uint8_t *eeprom, size_t eeprom_size,
                    char *error, size_t error_size);

// The address in RAM and the size of a variable, global or not. False if the file has none of that name, or more
// than one.
bool elf_image_variable(const char *path, const char *name, size_t *address, size_t *size);

#endif
