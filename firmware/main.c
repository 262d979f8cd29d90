// SPDX-License-Identifier: Apache-2.0
#include "board.h"
#include "hal.h"

int main(void)
{
    static struct board board;
    hal_init();
    board_init(&board);
    for (;;)
        board_poll(&board);
}
