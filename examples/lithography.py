# SPDX-License-Identifier: Apache-2.0
"""Files for lithography of a hologram: tiles of TIFF, of 1 bit or of heights in nm, and GDSII.

    raywave encode out/field.npy --format npy --set slm.levels=2 -o mask   # or 4, 8 ... levels
    python examples/lithography.py mask --index 1.46 --tile 4096 -o tiles

or of a hologram that was rendered in tiles, of which each becomes a TIFF:

    raywave render scene.toml -o out --tiles all --set slm.encoding=phase --set slm.levels=2
    python examples/lithography.py out --index 1.46 -o tiles

The TIFFs hold a height for each pixel: 1 bit where there are two levels (1, shown white, is the
higher one, of a mirror the deeper one), else 16-bit numbers, in nm / 10; their resolution is that
of the pitch. tiles.json tells their places, the steps, the unit and what 0 and 1 are. Rows of
pictures go down; y of GDSII and of tiles.json goes up from the hologram's middle.

--index N   relief of refractive index N that light passes: more height, more phase
--mirror    a mirror's depth instead: light passes it twice, and deeper is more phase
--gds       of two levels also mask.gds, the higher pixels, runs of a row as one rectangle; 1 um
            units, 1 nm grid. 16384 x 16384 pixels take minutes and gigabytes
Needs numpy, tifffile and, for --gds, gdstk, for holograms in tiles Pillow.
"""

import argparse
import importlib.util
import json
import pathlib
import sys

import numpy as np
import tifffile


def heights_nm(levels, slm, wavelength_m, index):
    """Height, or a mirror's depth, that delays light by the phase of each level."""
    if slm["lut"] or slm["invert"]:
        raise SystemExit("lithography.py: the hologram is for a panel with slm.lut or slm.invert; "
                         "encode it anew without them")
    turns = levels / slm["levels_per_turn"]
    return turns * wavelength_m * 1e9 / ((index - 1) if index else 2)


def whole_mask(file, side):
    """Columns and rows, and what yields pieces: first column, first row, levels."""
    frames = np.load(file, mmap_mode="r")
    if len(frames) != 1:
        raise SystemExit(f"lithography.py: {file.parent}: has {len(frames)} frames, and a mask "
                         "shows one: render with sampling.frames = 1")
    ny, nx = frames[0].shape
    return nx, ny, lambda: ((x, y, frames[0][y:y + side, x:x + side])
                            for y in range(0, ny, side) for x in range(0, nx, side))


def rendered_tiles(folder, report):
    """The same of a hologram in tiles; where two overlap, they are alike but for rounding."""
    from PIL import Image
    Image.MAX_IMAGE_PIXELS = None
    if report["scene"]["sampling"]["frames"] != 1:
        raise SystemExit(f"lithography.py: {folder}: a mask shows one frame: render with "
                         "sampling.frames = 1")
    tiles = report["tiles"]
    places = [(x, y) for y in tiles["rows_px"] for x in tiles["columns_px"]]
    files = [folder / (tiles["files"] % i) for i in range(len(places))]
    missing = [file.name for file in files if not file.exists()]
    if missing:
        raise SystemExit(f"lithography.py: {folder}: {missing[0]} is missing"
                         + (f", and {len(missing) - 1} more" if len(missing) > 1 else "")
                         + "; raywave render ... --tiles all makes them")
    nx, ny = report["scene"]["hologram"]["resolution"]

    def levels_of(file):
        try:
            return np.asarray(Image.open(file))
        except OSError as error:
            raise SystemExit(f"lithography.py: {file}: {error}; raywave render ... --tiles all "
                             "makes it anew") from None

    return nx, ny, lambda: ((x, y, levels_of(file)) for (x, y), file in zip(places, files))


def say(text):
    print(text, file=sys.stderr, flush=True)


def save_gds(file, high, pitch_m):
    """A rectangle for each run of high pixels in a row."""
    import gdstk
    library = gdstk.Library(unit=1e-6, precision=1e-9)
    cell = library.new_cell("HOLOGRAM")
    px, py = (1e6 * p for p in pitch_m)
    ny, nx = high.shape
    edges = np.diff(np.pad(high.astype(np.int8), ((0, 0), (1, 1))), axis=1)
    for row in range(ny):
        if row % 1024 == 0:
            say(f"mask.gds: row {row} of {ny}")
        y = (ny / 2 - row) * py
        starts, ends = np.flatnonzero(edges[row] == 1), np.flatnonzero(edges[row] == -1)
        for first, end in zip(starts, ends):
            cell.add(gdstk.rectangle(((first - nx / 2) * px, y - py), ((end - nx / 2) * px, y)))
    say("mask.gds: writing")
    library.write_gds(file)


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("hologram", type=pathlib.Path,
                        help="folder with hologram.npy, or tiles, and report.json")
    parser.add_argument("-o", "--output", type=pathlib.Path, required=True)
    parser.add_argument("--tile", type=int, default=4096, help="most pixels of a side of hologram.npy")
    parser.add_argument("--gds", action="store_true", help="of two levels: mask.gds, too")
    kind = parser.add_mutually_exclusive_group(required=True)
    kind.add_argument("--index", type=float)
    kind.add_argument("--mirror", action="store_true")
    options = parser.parse_args()
    if options.index is not None and options.index <= 1:
        parser.error("--index: a relief's index is above 1")

    report = json.loads((options.hologram / "report.json").read_text())
    scene, in_tiles = report["scene"], "tiles" in report
    if in_tiles and options.gds:
        parser.error("--gds: is for holograms in one piece")
    nx, ny, pieces = (rendered_tiles(options.hologram, report) if in_tiles
                      else whole_mask(options.hologram / "hologram.npy", options.tile))
    used = np.flatnonzero(sum(np.bincount(levels.ravel(), minlength=1024)
                              for _, _, levels in pieces()))

    def heights_of(levels):
        return heights_nm(levels, scene["slm"], scene["hologram"]["wavelength_m"], options.index)

    steps = heights_of(used)
    is_binary = len(steps) <= 2
    pitch_m = scene["hologram"]["pitch_m"]
    what = "depth of a mirror" if options.mirror else "height"
    if options.gds and not is_binary:
        raise SystemExit(f"lithography.py: --gds: needs two levels, and this has {len(steps)}")
    if options.gds and importlib.util.find_spec("gdstk") is None:
        raise SystemExit("lithography.py: --gds: needs gdstk (pip install gdstk)")
    try:
        options.output.mkdir(parents=True)
    except OSError as error:
        raise SystemExit(f"lithography.py: {options.output}: {error.strerror}; give a folder that "
                         "is not there yet") from None
    tiles = []
    largest = [0, 0]
    for x, y, levels in pieces():
        part = heights_of(levels)
        name = f"tile_{x}_{y}.tif"
        say(f"{name}: {len(tiles) + 1}")
        tifffile.imwrite(
            options.output / name,
            part > steps[0] if is_binary else np.round(10 * part).astype(np.uint16),
            photometric="minisblack", resolutionunit="CENTIMETER",
            resolution=tuple(0.01 / p for p in pitch_m))
        size = [part.shape[1], part.shape[0]]
        largest = [max(pair) for pair in zip(largest, size)]
        tiles.append({"file": name, "left_m": (x - nx / 2) * pitch_m[0],
                      "top_m": (ny / 2 - y) * pitch_m[1], "size_px": size})
    # Of one level nothing is higher, and all pixels are 0
    values = {"0": steps[0], "1": steps[-1]} if is_binary else None
    (options.output / "tiles.json").write_text(json.dumps(
        {"pitch_m": pitch_m, "heights_nm": steps.tolist(), "unit_nm": None if is_binary else 0.1,
         "what": what, "nm_of_values": values, "photometric": "MinIsBlack",
         "tiles": tiles}, indent=1))
    if options.gds:
        levels = np.load(options.hologram / "hologram.npy", mmap_mode="r")[0]
        save_gds(options.output / "mask.gds", heights_of(levels) > steps[0], pitch_m)
    print(f"{nx} x {ny} pixels in {len(tiles)} tile(s) of at most {largest[0]} x "
          f"{largest[1]}, {len(steps)} heights of {steps[0]:.4g} to {steps[-1]:.4g} nm"
          + (", mask.gds" if options.gds else ""))


if __name__ == "__main__":
    main()
