# SPDX-License-Identifier: Apache-2.0
"""What the measured tables of docs/ are made of, for scripts/measure."""

TABLES = {}


def table(page, sources, form, runs, timed=False):
    """A table with the name of the function that follows.

    page     of docs/
    sources  files and folders whose change makes it old
    form     its head, and a row with a field of Python's format() for each cell
    runs     commands by key; --json is added
    timed    its caption says what share of the processors other programs used

    The function gets what the commands have printed, by key, and yields rows of numbers and texts.
    """
    def add(rows):
        TABLES[rows.__name__] = {"page": page, "sources": sources, "form": form,
                                 "runs": dict(runs), "rows": rows, "timed": timed}
        return rows
    return add


def rooms(*names):
    return [f"host/{name}" for name in names]


FIELDS = [*rooms("carriers", "geometry", "plan", "planning", "propagate", "trace"),
          "kernels/gather", "kernels/propagate", "kernels/samples", "kernels/scene"]
PICTURES = [*FIELDS, *rooms("encode", "evaluate", "view"), "kernels/encode", "kernels/view"]
REFINED = [*PICTURES, "host/refine", "kernels/refine"]
FRAMES = [*FIELDS, "cl", "host/encode", "host/render.cpp", "kernels/encode"]
STAGES = ("samples", "trace", "propagate", "encode")


def sets(*keys):
    return "".join(f" --set {key}" for key in keys)


def field(folder, scene, *keys):
    return f"raywave render data/{scene}.toml -o {folder}" + sets("sampling.frames=1", *keys)


def points(scene):
    return field("points", scene) + " --method points"


def compare(a, b):
    return f"raywave compare {a}/field.npy {b}/field.npy"


def processor_s(bench):
    return bench["rows"][0]["processor_s"]["median"]


def stage_s(row, stage):
    """Processor seconds of a stage in a row of bench; 0 where it has none."""
    return row["stages"][stage]["processor_s"]["median"] if stage in row["stages"] else 0


def psnr(quality, of_field=False):
    """PSNR of whole pictures by depth, then of views."""
    rows = sorted(quality["rows"], key=lambda row: row["view"] != "whole")
    return [(row["field"] if of_field else row)["psnr_db"] for row in rows]


CONES = {"1.2, 0.2": "all", "1.2, 0.3": "`accurate` (up to 0.06)",
         "1.1, 0.3": "`draft`, `balanced`, `--budget`, `--psnr`, `--rate` (up to 0.25)",
         "1.0, 0.2": "none"}


@table("planning", FIELDS, """
| cone, apodization | predicted error | measured on the study | accepted by |
|---|---|---|---|
| {} | {:.2g} | {:.3f} | {} |""", {
    cone: "raywave quality data/study.toml --no-views --lens-points 4 --against-points"
    + sets("sampling.frames=1", "sampling.cone=" + cone[:3], "sampling.apodization=" + cone[5:])
    for cone in CONES})
def cones(seen):
    for cone, accepted in CONES.items():
        yield [cone, seen[cone]["render"]["plan"]["cone_error"],
               seen[cone]["against_points"]["relative_error"], accepted]


# Every scene of data/ that stands still, has one laser and no mirrors
DEMO = {f"`{name}`": f"data/{name}.toml" for name in (
    "animal", "animal_20mm", "apart", "around_slm", "ball_rough", "ball_smooth", "ball_textured",
    "plane", "plane_100mm", "room", "study", "teapot", "teapot_20mm", "teapot_corner",
    "teapot_deep", "teapot_four", "wire")}
OTHER = {"`still_life`": "data/still_life.toml",
         "`teapot` over WRPs": "data/teapot.toml" + sets("wrp.propagation=spectrum"),
         "`teapot`, refined in 4 iterations":
         "data/teapot.toml" + sets("slm.encoding=phase", "refine.iterations=4")}


@table("planning", [*FRAMES, "host/forecast", "host/refine", "kernels/refine"], """
| | predicted / measured |
|---|---|
| {} | {:.2f} |""", {
    (what, name): f"raywave {what} {scene}" for name, scene in (DEMO | OTHER).items()
    for what in ("plan", "bench --no-quality")}, timed=True)
def forecast(seen):
    def quotient(name):
        plan, bench = seen["plan", name], seen["bench --no-quality", name]
        measured_s = sum(stage_s(bench["rows"][0], stage) for stage in (*STAGES, "refine"))
        return (plan["prediction"]["seconds"]["total"] * bench["device"]["compute_units"]
                / measured_s)

    demo = sorted((quotient(name), name) for name in DEMO)
    yield [f"{len(demo)} demo scenes, median", demo[len(demo) // 2][0]]
    for value, name in (demo[0], demo[-1]):
        yield [f"the farthest of them: {name}", value]
    for name in OTHER:
        yield [name, quotient(name)]


@table("performance", FRAMES, """
| frame | over plain FFTW's time | ms | samples / trace / propagate / encode | MiB |
|---|---|---|---|---|
| {} | {:.2f} | {:.0f} | {:.1f} / {:.1f} / {:.1f} / {:.1f} | {:.0f} |""", {
    "frames": "raywave bench --suite cpu --only compact --no-quality --frames 15",
    "plain": "build/tests/bench_propagation --frames 5"}, timed=True)
def frames(seen):
    plain = next(row for row in seen["plain"] if row["name"] == "plain FFTW 2-D, 1 WRP")
    plain_s = sorted(frame["processor_s"] for frame in plain["frames"])
    for row in seen["frames"]["rows"]:
        frame_s = row["processor_s"]["median"]
        yield [row["name"].removesuffix(", compact"), frame_s / plain_s[len(plain_s) // 2],
               1e3 * frame_s, *(1e3 * stage_s(row, stage) for stage in STAGES),
               row["memory"]["device_peak_bytes"] / 2**20]


@table("performance", [*PICTURES, *FRAMES], """
| | processor s | dB |
|---|---:|---:|
| {} | {:.3g} | {:.1f} |""", {
    "paper": "raywave bench --suite paper --only 'methods teapot' --frames 1 --lens-points 4"},
    timed=True)
def methods(seen):
    for row in seen["paper"]["rows"]:
        yield [row["name"].split(", ", 1)[1], row["processor_s"]["median"],
               row["quality"]["psnr_db"] if row["quality"] else ""]


@table("performance", [*PICTURES, *FRAMES, "tests/bench"], """
| raywave over WRPs, against the peer | processor time | more dB |
|---|---|---|
| {} | {:.3f} | {:.1f} |""", {
    "ours": "raywave bench --suite cpu --only 'p 100 um, padding 2'",
    "peer": "raywave bench --suite cpu --only Embree"}, timed=True)
def peer(seen):
    for ours, theirs in zip(seen["ours"]["rows"], seen["peer"]["rows"]):
        yield [theirs["name"].split(", ")[1],
               ours["processor_s"]["median"] / theirs["processor_s"]["median"],
               ours["quality"]["psnr_db"] - theirs["quality"]["psnr_db"]]


@table("animation", [*FRAMES, "host/animate"], """
| ms of a picture | samples | trace | propagate | encode |
|---|---|---|---|---|
| {:.1f} | {:.1f} | {:.1f} | {:.1f} | {:.1f} |""", {
    "all": "raywave animate data/turntable.toml -o out --no-video --no-preview"}, timed=True)
def turntable(seen):
    made = seen["all"]
    stages = made["processor_seconds"]
    yield [1e3 * seconds / made["holograms"] for seconds in (
        sum(stages.values()), *(stages[stage] for stage in STAGES))]


@table("animation", FRAMES, """
| parts, at a time | s | processor s | 60 pictures in each, s |
|---|---|---|---|
| {} | {:.1f} | {:.1f} | {:.1f} |""", {"all": "scripts/scaling"}, timed=True)
def scaling(seen):
    rows = {tuple(row[:3]): row[3:] for row in seen["all"]["rows"]}
    for parts, workers, each in ((1, 1, (60, 1, 1)), (8, 1, None), (8, 2, (120, 2, 2)),
                                 (8, 4, (240, 4, 4)), (100, 1, None)):
        yield [f"{parts}, {workers}", *rows[240, parts, workers], rows[each][0] if each else ""]


GREEN = sets("colour.only='\"520 nm\"'")
LASERS = {"`data/colour.toml`": "colour.toml", "`data/teapot.toml`": "teapot.toml" + sets(
    "hologram.wavelength='[\"638 nm\", \"520 nm\", \"450 nm\"]'")}


@table("colour", FRAMES, """
| | time of three lasers over one |
|---|---|
| {} | {:.1f} |""", {
    (scene, only): f"raywave bench data/{LASERS[scene]}{only} --no-quality"
    for scene in LASERS for only in ("", GREEN)}, timed=True)
def lasers(seen):
    for scene in LASERS:
        yield [scene, processor_s(seen[scene, ""]) / processor_s(seen[scene, GREEN])]


PACE = ("2", "4", "8")


def pace_runs():
    scene = "data/teapot.toml" + sets("slm.encoding=phase")
    yield "phase", f"raywave bench {scene} --no-quality"
    for count in PACE:
        keys = sets(f"refine.iterations={count}")
        yield count, f"raywave bench {scene}{keys} --no-quality"
        yield (count, "dB"), f"raywave refine {scene}{keys} -o out"


@table("refine", [*REFINED, *FRAMES], """
| iterations | refined depths | depths between | views | time |
|---|---|---|---|---|
| {} | {:.1f} | {:.1f} | {:.1f} | {:.1f} |""", pace_runs(), timed=True)
def pace(seen):
    def lowest(count, which):
        rows = seen[count, "dB"]["refine"]["rows"]
        return [min(row["psnr_db"][which] for row in rows if row["role"] == role)
                for role in ("optimised", "held out", "view")]

    yield ["complex field", *lowest(PACE[-1], "field"), ""]
    yield ["phase", *lowest(PACE[-1], "unrefined"), 1]
    for count in PACE:
        yield [count, *lowest(count, "refined"),
               processor_s(seen[count]) / processor_s(seen["phase"])]


STUDY = {"its grey levels by double phase": sets("slm.encoding=double-phase"),
         "its grey levels by phase": sets("slm.encoding=phase"),
         "12 iterations": sets("refine.iterations=12"),
         "refined": sets("refine.blur=15um", "refine.views=0"),
         "refined, 24 views": sets("refine.blur=15um", "refine.views=24")}


@table("refine", REFINED, """
| | front 18.55 mm | back 19.5 mm | defocus 17.55 mm | 22 mm | views | light | haze |
|---|---|---|---|---|---|---|---|
| {} | {:.1f} | {:.1f} | {:.1f} | {:.1f} | {:.1f} to {:.1f} | {:.2f} | {:.1g} |""", {
    name: "raywave quality data/study.toml --blur 15um --window 1.436mmx1.436mm -z 18.55mm"
    " -z 19.5mm -z 17.55mm -z 22mm" + sets("sampling.frames=4") + keys
    for name, keys in STUDY.items()})
def refined(seen):
    def cells(quality, of_field):
        db, front = psnr(quality, of_field), quality["rows"][0]
        more = ["", ""] if of_field else [front["light_share"], front["haze"]]
        return [*db[:4], min(db[4:]), max(db[4:]), *more]

    yield ["complex field", *cells(seen["its grey levels by phase"], True)]
    for name in STUDY:
        yield [name, *cells(seen[name], False)]


TEAPOT = ("raywave quality data/teapot.toml --lens-points 6 --no-views --window 14.36mmx8.08mm"
          + sets("sampling.pitch=50um", "sampling.frames=4"))


@table("quality", PICTURES, """
| teapot | front | back | defocus | light |
|---|---|---|---|---|
| {} | {:.1f} | {:.1f} | {:.1f} | {:.2f} |""", {
    name.replace("-", " "): TEAPOT + sets(f"slm.encoding={name}")
    for name in ("double-phase", "phase")})
def encodings(seen):
    yield ["field", *psnr(seen["phase"], of_field=True), ""]
    for name, quality in seen.items():
        yield [name, *psnr(quality), quality["rows"][0]["light_share"]]


WRPS = "wrp.propagation=spectrum"
PADDINGS = ("1", "1.125", "1.25", "1.5", "2")


def padding_runs():
    yield "points", points("study")
    for mode in ("aimed", "fan"):
        for padding in ("6", *PADDINGS):
            yield (mode, padding), field(mode + padding, "study", WRPS, f"sampling.mode={mode}",
                                         f"wrp.padding={padding}")
            yield (mode, padding, "alone"), compare(mode + "6", mode + padding)
            yield (mode, padding, "error"), compare("points", mode + padding)


@table("accuracy", FIELDS, """
| padding | against padding 6 | against all points | stated | fans against padding 6 |
|---|---|---|---|---|
| {} | {:#.2g} | {:#.2g} | {:#.2g} | {:#.2g} |""", padding_runs())
def padding(seen):
    for factor in PADDINGS:
        yield [factor, seen["aimed", factor, "alone"]["relative_error"],
               seen["aimed", factor, "error"]["relative_error"],
               seen["aimed", factor]["plan"]["propagation_error"],
               seen["fan", factor, "alone"]["relative_error"]]


DEMO_FIELDS = ("teapot", "study", "room", "teapot_20mm")


def points_runs():
    for scene in DEMO_FIELDS:
        yield scene, points(scene)
        for way in ("compact", "spectrum"):
            yield (scene, way), field("out", scene, f"wrp.propagation={way}")
            yield (scene, way, "error"), compare("points", "out")
            yield (scene, way, "levels"), ("raywave quality out/report.json --lens-points 4"
                                           " --no-views")


@table("accuracy", PICTURES, """
| | virtual planes | levels, dB | WRPs | levels, dB | stated |
|---|---|---|---|---|---|
| {} | {:.3f} | {:.1f} | {:.3f} | {:.1f} | {:.3f} |""", points_runs())
def against_points(seen):
    for scene in DEMO_FIELDS:
        cells = []
        for way in ("compact", "spectrum"):
            db = psnr(seen[scene, way, "levels"])
            cells += [seen[scene, way, "error"]["relative_error"], sum(db) / len(db)]
        yield [f"`{scene}`", *cells, seen[scene, "spectrum"]["plan"]["propagation_error"]]


def tiles_runs():
    yield "points", points("teapot")
    for side in (1, 2, 4):
        for padding in PADDINGS[::2]:
            yield (side, padding), field("tiles", "teapot", WRPS, f"wrp.padding={padding}",
                                         f"hologram.tiles='[{side}, {side}]'")
            yield (side, padding, "error"), compare("points", "tiles")


@table("accuracy", FIELDS, """
| tiles | padding 1 | 1.25 | 2 |
|---|---|---|---|
| {} | {:.3f} ({:.3f}) | {:.3f} ({:.3f}) | {:.3f} ({:.3f}) |""", tiles_runs())
def tiles(seen):
    for side in (1, 2, 4):
        yield [f"{side} x {side}", *(cell for padding in PADDINGS[::2] for cell in (
            seen[side, padding, "error"]["relative_error"],
            seen[side, padding]["plan"]["propagation_error"]))]


@table("accuracy", [*FIELDS, "host/evaluate/selftest", "host/reference"], """
| extreme | carrier | relative L2 | of the bound |
|---|---|---|---|
| {} | {} | {:.1e} | {:.2g} % |""", {"selftest": "raywave selftest"})
def extremes(seen):
    for row in seen["selftest"]["extremes"]:
        yield (row["extreme"], row["carrier"], row["measured"],
               100 * row["measured"] / row["bound"])


EIGHT = ("study", "teapot", "animal", "ball_smooth", "wire", "apart", "room", "still_life")
PRESETS = ("draft", "balanced", "accurate", "reference")


@table("planning", [*REFINED, *FRAMES, "host/forecast"], """
| ms, dB (dB predicted) | draft | balanced | accurate | reference |
|---|---|---|---|---|
| {} | {} | {} | {} | {} |""", {
    scene: f"raywave trade data/{scene}.toml -o {scene} --presets" for scene in EIGHT}, timed=True)
def presets(seen):
    rows = {scene: {entry["preset"]: trade["rows"][entry["row"]] for entry in trade["presets"]}
            for scene, trade in seen.items()}

    def cell(row):
        predicted = [laser["pictures"]["mean_psnr_db"] for laser in row["predicted"]]
        ms = float(f"{1e3 * row['time_s']:.3g}")
        return f"{ms:g}, {row['psnr_db']:.1f} ({sum(predicted) / len(predicted):.1f})"

    for scene in EIGHT:
        yield [f"`{scene}`", *(cell(rows[scene][preset]) for preset in PRESETS)]
    drafts = [rows[scene]["draft"] for scene in EIGHT]

    def over_draft(preset):
        pairs = [(rows[scene][preset], draft) for scene, draft in zip(EIGHT, drafts)]
        times = sorted(row["time_s"] / draft["time_s"] for row, draft in pairs)
        gains = [row["psnr_db"] - draft["psnr_db"] for row, draft in pairs]
        middle = (times[len(times) // 2] + times[(len(times) - 1) // 2]) / 2
        return f"{middle:.1f} x, {sum(gains) / len(gains):+.1f} dB"

    yield ["over `draft`: median time, mean gain", "", *map(over_draft, PRESETS[1:])]
