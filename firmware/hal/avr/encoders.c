// SPDX-License-Identifier: Apache-2.0
//
// Both encoders by edge interrupts on all four inputs.
#include <avr/interrupt.h>
#include <avr/io.h>

#include "hal.h"
#include "parts.h"
#include "pins.h"
#include "quadrature.h"

static struct quadrature crank, carriage;

static inline uint8_t crank_levels(void)
{
    return (ENCODERS_PIN >> CRANK_SHIFT) & 3;
}

static inline uint8_t carriage_levels(void)
{
    return (ENCODERS_PIN >> CARRIAGE_SHIFT) & 3;
}

void encoders_init(void)
{
    ENCODERS_PORT |= ENCODERS_MASK; // pull-ups for open-collector encoders
    crank.state = crank_levels();
    carriage.state = carriage_levels();
    EICRA = _BV(ISC00) | _BV(ISC10) | _BV(ISC20) | _BV(ISC30); // any edge
    EIFR = ENCODERS_MASK;
    EIMSK = ENCODERS_MASK;
}

// A and B share a handler. An alias, because the compiler would merge two equal handlers into one
// that calls the other, whose reti enables interrupts too early.
ISR(INT0_vect)
{
    quadrature_step(&crank, crank_levels());
}
ISR(INT1_vect, ISR_ALIASOF(INT0_vect));

ISR(INT2_vect)
{
    quadrature_step(&carriage, carriage_levels());
}
ISR(INT3_vect, ISR_ALIASOF(INT2_vect));

void hal_encoders_read(struct hal_encoders *encoders)
{
    encoders->crank = crank.count;
    encoders->carriage = carriage.count;
    encoders->illegal_steps = crank.illegal_steps + carriage.illegal_steps;
    encoders->crank_edges = crank.edges;
}
