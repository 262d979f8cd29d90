// SPDX-License-Identifier: GPL-3.0-or-later
#include "elf_image.h"

#include <errno.h>
#include <fcntl.h>
#include <gelf.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

enum {
    // avr-ld's physical addresses of the memories beside the flash
    EEPROM_BASE = 0x810000,
    EEPROM_END = 0x820000,
    RAM_BASE = 0x800000,
};

// Where a segment goes: NULL if it does not belong into the chip's flash or EEPROM (fuses, lock bits).
static uint8_t *destination(uint64_t address, uint64_t size, uint8_t *flash, size_t flash_size, uint8_t *eeprom,
                            size_t eeprom_size, bool *fits)
{
    *fits = true;
    if (address >= EEPROM_END)
        return NULL;
    if (address >= EEPROM_BASE) {
        *fits = address - EEPROM_BASE + size <= eeprom_size;
        return eeprom + (address - EEPROM_BASE);
    }
    *fits = address + size <= flash_size;
    return flash + address;
}

static bool load_segments(Elf *elf, int file, uint8_t *flash, size_t flash_size, uint8_t *eeprom,
                          size_t eeprom_size, const char **problem)
{
    GElf_Ehdr header;
    size_t count;
    *problem = "is not an ELF executable for AVR";
    if (elf_kind(elf) != ELF_K_ELF || !gelf_getehdr(elf, &header) || header.e_machine != EM_AVR ||
        header.e_type != ET_EXEC || elf_getphdrnum(elf, &count) != 0)
        return false;
    bool loaded = false;
    for (size_t i = 0; i < count; i++) {
        GElf_Phdr segment;
        *problem = "is damaged";
        if (!gelf_getphdr(elf, (int)i, &segment))
            return false;
        if (segment.p_type != PT_LOAD || segment.p_filesz == 0)
            continue;
        bool fits;
        uint8_t *to = destination(segment.p_paddr, segment.p_filesz, flash, flash_size, eeprom, eeprom_size, &fits);
        if (!fits) {
            *problem = "does not fit into the microcontroller";
            return false;
        }
        if (!to)
            continue;
        if (pread(file, to, segment.p_filesz, (off_t)segment.p_offset) != (ssize_t)segment.p_filesz)
            return false;
        loaded = true;
    }
    *problem = "has nothing to load";
    return loaded;
}

bool elf_image_load(const char *path, uint8_t *flash, size_t flash_size, uint8_t *eeprom, size_t eeprom_size,
                    char *error, size_t error_size)
{
    int file = open(path, O_RDONLY | O_CLOEXEC);
    if (file < 0) {
        snprintf(error, error_size, "firmware %s: %s", path, strerror(errno));
        return false;
    }
    elf_version(EV_CURRENT);
    Elf *elf = elf_begin(file, ELF_C_READ, NULL);
    const char *problem = "is not an ELF executable for AVR";
    bool ok = elf && load_segments(elf, file, flash, flash_size, eeprom, eeprom_size, &problem);
    if (!ok)
        snprintf(error, error_size, "firmware %s %s; build it with make -C firmware", path, problem);
    if (elf)
        elf_end(elf);
    close(file);
    return ok;
}

static int count_variables(Elf *elf, const char *name, size_t *address, size_t *size)
{
    int found = 0;
    for (Elf_Scn *section = NULL; (section = elf_nextscn(elf, section));) {
        GElf_Shdr header;
        if (!gelf_getshdr(section, &header) || header.sh_type != SHT_SYMTAB || header.sh_entsize == 0)
            continue;
        Elf_Data *data = elf_getdata(section, NULL);
        GElf_Sym symbol;
        for (size_t i = 0; data && i < header.sh_size / header.sh_entsize; i++) {
            const char *its_name;
            if (!gelf_getsym(data, (int)i, &symbol) || GELF_ST_TYPE(symbol.st_info) != STT_OBJECT ||
                symbol.st_value < RAM_BASE || symbol.st_value >= EEPROM_BASE ||
                !(its_name = elf_strptr(elf, header.sh_link, symbol.st_name)) || strcmp(its_name, name) != 0)
                continue;
            *address = symbol.st_value - RAM_BASE;
            *size = symbol.st_size;
            found++;
        }
    }
    return found;
}

bool elf_image_variable(const char *path, const char *name, size_t *address, size_t *size)
{
    int file = open(path, O_RDONLY | O_CLOEXEC);
    if (file < 0)
        return false;
    elf_version(EV_CURRENT);
    Elf *elf = elf_begin(file, ELF_C_READ, NULL);
    int found = elf ? count_variables(elf, name, address, size) : 0;
    if (elf)
        elf_end(elf);
    close(file);
    return found == 1;
}
