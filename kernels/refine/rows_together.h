// SPDX-License-Identifier: Apache-2.0
#ifndef RAYWAVE_ROWS_TOGETHER_H
#define RAYWAVE_ROWS_TOGETHER_H

// Rows that are blurred along y side by side, and share what is read of those around them; as many
// as blurred_columns has sums.
#define ROWS_TOGETHER 4

#endif
