// SPDX-License-Identifier: Apache-2.0
//
// Both encoders by edge interrupts on all four inputs. The timers' encoder mode would count without
// the processor, but cannot tell an illegal step from none, and of those the host must know.
#include "hal.h"
#include "parts.h"
#include "pins.h"
#include "quadrature.h"

#define LINES(shift) (3u << (shift))

static struct quadrature crank, carriage;

void crank_edge_handler(void);
void carriage_edge_handler(void);

static inline uint8_t levels(uint32_t shift)
{
    return (uint8_t)(ENCODERS->IDR >> shift & 3u);
}

void encoders_init(void)
{
    uint32_t ports = 0;
    for (uint32_t line = 0; line < 4; line++) {
        pin_pull_up(ENCODERS, line); // for open-collector encoders
        ports |= SYSCFG_EXTICR_PORT_C << 4 * line;
    }
    SYSCFG->EXTICR[0] = ports;
    const uint32_t lines = LINES(CRANK_SHIFT) | LINES(CARRIAGE_SHIFT);
    EXTI->RTSR = lines;
    EXTI->FTSR = lines;
    EXTI->PR = lines;
    crank.state = levels(CRANK_SHIFT);
    carriage.state = levels(CARRIAGE_SHIFT);
    EXTI->IMR = lines;
    for (enum interrupt line = IRQ_EXTI0; line <= IRQ_EXTI3; line++)
        interrupt_enable(line);
}

// A and B share a handler. The request is cleared before the levels are read: an edge after that
// makes a new one.

void crank_edge_handler(void)
{
    EXTI->PR = LINES(CRANK_SHIFT);
    quadrature_step(&crank, levels(CRANK_SHIFT));
}

void carriage_edge_handler(void)
{
    EXTI->PR = LINES(CARRIAGE_SHIFT);
    quadrature_step(&carriage, levels(CARRIAGE_SHIFT));
}

void hal_encoders_read(struct hal_encoders *encoders)
{
    encoders->crank = crank.count;
    encoders->carriage = carriage.count;
    encoders->illegal_steps = crank.illegal_steps + carriage.illegal_steps;
    encoders->crank_edges = crank.edges;
}
