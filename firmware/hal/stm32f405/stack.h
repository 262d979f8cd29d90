// SPDX-License-Identifier: Apache-2.0
//
// The stack's place in the linker script, and what it is painted with.
#ifndef STACK_H
#define STACK_H

#include <stdint.h>

#define STACK_PAINT 0xA5

extern uint8_t _stack_bottom, _stack_top; // NOLINT: the linker's names

#endif
