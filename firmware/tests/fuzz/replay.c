// SPDX-License-Identifier: Apache-2.0
//
// Runs a fuzz target on files, where libFuzzer's own main is not at hand: replay FILE...
#include <stdio.h>
#include <stdlib.h>

#include "fuzz_target.h"

#define LONGEST 65536u

int main(int argc, char **argv)
{
    for (int i = 1; i < argc; i++) {
        FILE *file = fopen(argv[i], "rb");
        if (file == NULL) {
            perror(argv[i]);
            return EXIT_FAILURE;
        }
        // Exactly as large as the input, so that a read behind it is seen.
        uint8_t *data = malloc(LONGEST);
        size_t size = fread(data, 1, LONGEST, file);
        fclose(file);
        data = realloc(data, size > 0 ? size : 1);
        LLVMFuzzerTestOneInput(data, size);
        free(data);
    }
    printf("%s: %d inputs\n", argv[0], argc - 1);
    return EXIT_SUCCESS;
}
