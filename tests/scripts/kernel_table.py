#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Tests of scripts/kernel_table: small kernels whose table is known, and the kernels of a frame on
an FPGA, where raywave is given as the argument."""

import json
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
PROGRAM = sys.argv.pop(1) if len(sys.argv) > 1 else ""
SINGLE = "__kernel __attribute__((reqd_work_group_size(1, 1, 1))) void"


def tables(folder):
    subprocess.run([ROOT / "scripts/kernel_table", folder, "--json", folder / "table.json"],
                   stdout=subprocess.PIPE, check=True)
    return json.loads((folder / "table.json").read_text(encoding="utf-8"))["kernels"]


def table(source):
    """Of the only kernel of a source, whose first line is line 1 of small.cl."""
    with tempfile.TemporaryDirectory() as folder:
        frame = Path(folder) / "frame.cl"
        frame.write_text(f'#line 1 "small.cl"\n{source}\n', encoding="utf-8")
        return tables(Path(folder))[0]


def loop(arguments, body, before=""):
    """The only loop of a kernel of one work-item, and all of its table."""
    found = table(f"{SINGLE} k({arguments}) {{\n{before}\n{body}\n}}")
    assert len(found["loops"]) == 1, found["loops"]
    return found["loops"][0], found


class KernelTable(unittest.TestCase):
    def test_a_loop_of_known_trips_is_counted_with_its_operations_and_place(self):
        row, found = loop("__global const float* restrict a, __global float* restrict b",
                          "for (int i = 0; i < 24; ++i) b[i] = a[i] * 3.0f + sqrt(a[i]) / 7.0f;")
        self.assertEqual((row["trips"], row["known"], row["place"], row["depth"]),
                         ("24", "constant", "small.cl:3", 1))
        self.assertEqual((row["interval"], row["reason"]), ("1", "nothing is carried"))
        self.assertEqual({name: row["operations"].get(name) for name in (
            "fmul", "fadd", "fdiv", "sqrt", "global read", "global write")},
            {"fmul": 1, "fadd": 1, "fdiv": 1, "sqrt": 1, "global read": 1, "global write": 1})
        self.assertEqual(row["streams"], {
            "reads a: consecutive, 4 B": 1, "writes b: consecutive, 4 B": 1})
        self.assertTrue(found["is_single"])
        self.assertEqual((found["private"], found["local"]), ([], []))

    def test_an_argument_bounds_a_loop(self):
        row, _ = loop("__global float* b, int count", "for (int i = 0; i < count; ++i) b[i] = 1;")
        self.assertEqual((row["trips"], row["known"], row["set_by"]),
                         ("count", "argument", ["count"]))

    def test_what_is_read_bounds_a_loop(self):
        row, _ = loop("__global const int* restrict n, __global float* restrict b",
                      "for (int i = n[0]; i < n[1]; ++i) b[i] = 1;")
        self.assertEqual((row["trips"], row["known"]), ("set by n", "argument"))

    def test_trips_that_data_decide_are_unknown_and_name_it(self):
        row, _ = loop("__global const float* restrict a, __global float* restrict b",
                      "int i = 0; while (a[i] > 0.0f) { b[i] = a[i]; ++i; }")
        self.assertEqual((row["trips"], row["known"], row["interval"]),
                         ("unknown, ends by a test of a", "unknown", "unknown"))

    def test_a_sum_of_floats_begins_an_iteration_after_each_addition(self):
        row, _ = loop("__global const float* restrict a, __global float* restrict b, int n",
                      "for (int i = 0; i < n; ++i) sum += a[i] * 2.0f; *b = sum;",
                      "float sum = 0;")
        self.assertEqual((row["interval"], row["reason"]), ("latency(fadd)", "carried: sum"))

    def test_a_sum_of_integers_takes_a_clock(self):
        row, _ = loop("__global const int* restrict a, __global int* restrict b, int n",
                      "for (int i = 0; i < n; ++i) sum += a[i]; *b = sum;", "int sum = 0;")
        self.assertEqual(row["interval"], "1")

    def test_two_values_that_feed_each_other_are_unknown(self):
        row, _ = loop("__global float* restrict b, int n, float c",
                      "for (int i = 0; i < n; ++i) {"
                      "float t = x * c - y; y = x + y * c; x = t; b[i] = x; }",
                      "float x = 1, y = 0;")
        self.assertEqual(row["interval"], "unknown")

    def test_a_value_in_memory_is_carried_over_as_many_iterations_as_lie_between(self):
        row, _ = loop("__global float* restrict a, int n",
                      "for (int i = 2; i < n; ++i) a[i] = a[i - 2] * 0.5f;")
        self.assertEqual((row["interval"], row["reason"]), (
            "latency(load + fmul + store) / 2", "a is read 2 iterations after it is written"))
        row, _ = loop("__global float* restrict a, int n",
                      "for (int i = 0; i < n; ++i) a[i] = a[i + 2] * 0.5f;")
        self.assertEqual(row["interval"], "1")
        row, _ = loop("__global float* restrict a, int n",
                      "for (int i = n; i > 0; --i) a[i] = a[i + 1000000] * 0.5f;")
        self.assertEqual(row["interval"], "latency(load + fmul + store) / 1000000")
        row, _ = loop("__global float* restrict a",
                      "for (int i = 16; i < 32; ++i) a[i] = a[i - 16] * 0.5f;")
        self.assertEqual(row["interval"], "1")
        row, _ = loop("__global volatile float* restrict a, int n",
                      "for (int i = 0; i < n; ++i) a[3] += 0.5f;")
        self.assertEqual(row["interval"], "latency(load + fadd + store)")

    def test_pointers_may_overlap_unless_one_is_restrict(self):
        body = "for (int i = 0; i < n; ++i) b[i] = a[i];"
        row, _ = loop("__global const int* a, __global int* b, int n", body)
        self.assertEqual((row["interval"], row["reason"]),
                         ("unknown", "b may overlap a (no restrict)"))
        row, _ = loop("__global const int* a, __global int* restrict b, int n", body)
        self.assertEqual(row["interval"], "1")

    def test_a_stream_has_its_stride_and_its_direction(self):
        row, _ = loop("__global const float* restrict a, __global const float* restrict c,"
                      "int step, __global float* restrict b, int n,"
                      "__global const float* restrict d",
                      "for (int i = 0; i < n; ++i) b[-i] = a[5 * i] + c[step * i] + d[i / 2];")
        self.assertEqual(row["streams"], {
            "reads a: stride 20 B, 4 B": 1, "reads c: stride set by step, 4 B": 1,
            "reads d: unknown, 4 B": 1, "writes b: consecutive, backwards, 4 B": 1})

    def test_vectors_that_are_loaded_by_vload_are_streams_of_their_size(self):
        row, _ = loop("__global const float* restrict a, __global float* restrict b, int n",
                      "for (int i = 0; i < n; ++i) vstore3(vload4(i, a).xyz * 2.0f, 0, b + 8 * i);")
        self.assertEqual(row["streams"], {
            "reads a: consecutive, 16 B": 1, "writes b: stride 32 B, 12 B": 1})
        self.assertEqual(row["operations"]["fmul"], 3)

    def test_a_gather_is_scattered_and_is_waited_for(self):
        row, _ = loop("__global const float* restrict a, __global const int* restrict index,"
                      "__global float* restrict b, int n",
                      "for (int i = 0; i < n; ++i) b[i] = a[index[i]];")
        self.assertIn("reads a: scattered, 4 B", row["streams"])
        self.assertIn("reads index: consecutive, 4 B", row["streams"])
        self.assertEqual((row["interval"], row["reason"]), (">= 1", "waits for scattered a"))

    def test_what_is_added_at_places_that_are_read_may_be_carried(self):
        row, _ = loop("__global float* restrict a, __global const int* restrict index, int n",
                      "for (int i = 0; i < n; ++i) a[index[i]] += 1.0f;")
        self.assertEqual(row["interval"], "unknown")

    def test_an_atomic_operation_is_named_and_its_interval_unknown(self):
        row, _ = loop("__global int* restrict b, int n",
                      "for (int i = 0; i < n; ++i) atomic_add(b + 2 * i, 1);")
        self.assertEqual((row["streams"], row["operations"]["atomic_add"]),
                         ({"atomic_add of b: stride 8 B": 1}, 1))
        self.assertEqual((row["interval"], row["reason"]), ("unknown", "calls atomic_add"))

    def test_local_memory_has_its_bytes_and_the_hosts_part_its_name(self):
        found = table("__kernel void k(__global float* b, __local float* scratch) {\n"
                      "__local float4 tile[10][3]; int i = get_local_id(0);\n"
                      "tile[i][1] = b[i]; scratch[i] = b[i + 1]; barrier(CLK_LOCAL_MEM_FENCE);\n"
                      "b[i] = tile[9 - i][1].x + scratch[2 - i]; }")
        self.assertEqual([v["bytes"] for v in found["local"]], [480])
        self.assertEqual(found["local_arguments"], ["scratch"])
        self.assertFalse(found["is_single"])

    def test_a_private_array_with_a_changing_index_has_its_bytes(self):
        row, found = loop("__global const int* restrict a, __global int* restrict b, int n",
                          "for (int i = 0; i < n; ++i) ++counts[a[i] & 31]; *b = counts[n & 31];",
                          "int counts[32]; counts[n] = n;")
        self.assertEqual(found["private"], [{"name": "counts", "bytes": 128}])
        self.assertEqual(row["interval"], "unknown")

    def test_a_variable_of_an_iteration_is_not_carried_to_the_next(self):
        found = table(f"{SINGLE} k(__global float* restrict b, int n) {{\n"
                      "for (int j = 0; j < n; ++j) { float part[8];\n"
                      "for (int i = 0; i < 8; ++i) part[i] = b[8 * j + i];\n"
                      "b[j] = part[j & 7]; } }")
        outer, inner = found["loops"]
        self.assertEqual((outer["depth"], inner["depth"], inner["trips"]), (1, 2, "8"))
        self.assertNotIn("part", outer["reason"])
        self.assertEqual(outer["interval"], "unknown")

    def test_work_items_have_patterns_outside_loops(self):
        found = table("__kernel void k(__global const float* a, __global float* b, int n) {\n"
                      "int i = get_global_id(0), j = get_global_id(1);\nb[j * n + i] = a[2 * i]; }")
        self.assertEqual(found["outside_loops"]["streams"], {
            "reads a: stride 8 B, 4 B": 1, "writes b: consecutive, 4 B": 1})

    @unittest.skipUnless(PROGRAM, "no raywave was given")
    def test_fpga_kernels_have_small_private_arrays_and_loops_that_are_bounded_or_explained(self):
        with tempfile.TemporaryDirectory() as root:
            folder = Path(root) / "board"
            subprocess.run([PROGRAM, "kernels", ROOT / "data/teapot.toml", "-o", folder, "--target",
                            "aoc", "--quiet"], stdout=subprocess.PIPE, check=True)
            found = tables(folder)
        self.assertIn("gather_compact", [kernel["kernel"] for kernel in found])
        for kernel in found:
            self.assertTrue(kernel["is_single"], kernel["kernel"])
            self.assertEqual((kernel["local"], kernel["local_arguments"]), ([], []))
            self.assertLessEqual(sum(v["bytes"] for v in kernel["private"]), 16384)
            for row in kernel["loops"]:
                self.assertTrue(row["known"] == "constant" or row["set_by"], row)
                self.assertRegex(row["place"], r"^kernels/[\w/]+\.(cl|h):\d+$")


if __name__ == "__main__":
    for tool, package in (("clang-14", "clang-14"), ("opt-14", "llvm-14")):
        if not shutil.which(tool):
            sys.exit(subprocess.run([ROOT / "scripts/skip", package, "a table of each kernel"],
                                    check=False).returncode)
    unittest.main()
