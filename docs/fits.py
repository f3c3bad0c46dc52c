"""Fits of many scans by one program, or by several, side by side.

python3 docs/fits.py --program before=OLD/wakescope --program after=target/release/wakescope --scans 100 --folder target/fits

Needs nothing but Python. Maps of points and of means are the exact velocities of tests/reference/estimate with noise of their own; scenes go through
the whole chain, each program with its own `run`. Prints one row of Markdown for each case and program: scans in which both vortices are
found, mean error of the circulation within 5 to 15 m with its standard error, scatter of one scan over the Cramér-Rao bound (maps of points and
of means alone), root mean square error over the stated deviation, shares of errors within one and two of these, scans that show secondary
vortices, seconds of processor a scan. The coarse wake is run by the last of the programs, which takes some minutes, unless the folder has it.
"""

import argparse
import csv
import math
import random
import resource
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parent.parent
REFERENCE = ROOT / "tests/reference"
# Map: circulations within 5 to 15 m of the left and the right vortex, their bounds with all parameters free, standard deviation of a gate's weight.
# The bounds are those of the total circulations, whose scatter is held against them.
MAPS = {
    "a": ((466.635, 466.635), (3.43065, 3.74845), 0),
    "b": ((269.128, 269.128), (8.82252, 9.44185), 15),
    "c": ((388.658, 314.628), (3.64935, 3.73507), 10),
}
OUTLIERS = 0.05
TURBULENCE_M_S, TURBULENCE_LENGTH_M = 0.8, 20.0
SCENE = """seed = {seed}
[scan]
elevation_min_rad = 0.02
elevation_max_rad = 0.2
elevation_step_rad = 2.5e-3
pulses_per_line = 4
realisations = {scans}
outside_flow = {{ policy = "mask" }}
[detector.snr]
reference = "fixed"
snr_db = {snr_db}
[estimator]
gate_step_samples = 15
[outputs]
svg = false
png = false
flow = false
[retrieval]
secondary = "{secondary}"
[flow]
{flow}
"""
COARSE = """[case]
kind = "wake"
[output]
fields = []
[wake]
end_tau = 4.0
fields_tau = []
planes_tau = [4.0]
"""
LOW = 'kind = "vortex_pair"\ncirculation_m2_s = 360.0\nspacing_m = 40.0\ncore_radius_m = 3.0\nheight_m = 30.0\ncross_wind_m_s = 2.0\n'


def noisy(name, scans, seed, folder, outliers=0.0, turbulence=False):
    """Files of a map with noise, and with outliers or with turbulence."""
    lines = (REFERENCE / f"estimate/map_{name}.csv").read_text().splitlines()
    head = [line for line in lines if line.startswith("#")]
    names, *cells = [line.split(",") for line in lines if not line.startswith("#")]
    files = []
    for scan in range(scans):
        draw = random.Random(f"{seed} {name} {outliers} {turbulence} {scan}")
        waves = [
            (draw.gauss(0, 1 / TURBULENCE_LENGTH_M), draw.gauss(0, 1 / TURBULENCE_LENGTH_M), draw.uniform(0, 2 * math.pi))
            for _ in range(200)
        ]
        rows = []
        for cell in cells:
            range_m, elevation_rad, time_s, _, sigma_m_s, exact_m_s = map(float, cell)
            velocity_m_s = exact_m_s + draw.gauss(0, sigma_m_s)
            if turbulence:
                y_m, z_m = range_m * math.cos(elevation_rad), range_m * math.sin(elevation_rad)
                field = sum(math.cos(k * y_m + m * z_m + phase) for k, m, phase in waves)
                velocity_m_s += TURBULENCE_M_S * math.sqrt(2 / len(waves)) * field
            if draw.random() < outliers:
                velocity_m_s = draw.uniform(-20, 20)
            rows.append(f"{range_m},{elevation_rad},{time_s},{velocity_m_s:.4f},{sigma_m_s}")
        file = folder / f"{scan:03}.csv"
        file.write_text("\n".join([*head, ",".join(names[:5]), *rows]) + "\n")
        files.append(file)
    return files


def called(program, *arguments):
    """Seconds of processor that a call takes."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run([program, *map(str, arguments), "--quiet"], capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"{program} {arguments[0]}: {done.stderr}")
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def number(row, name):
    return float(row[name] or "nan")


def rows(folder):
    with open(folder / "retrieval.csv", encoding="utf-8") as file:
        return list(csv.DictReader(line for line in file if not line.startswith("#")))


def table(case, program, found, truth, bounds, count, seconds):
    """The row of one case; `found` has a scan's vortices, left and right, or none."""
    errors, scaled, shown = [], [], 0
    scatter = [[], []]
    for scan in found:
        shown += any("secondary_vortices" in row["flags"].split() for row in scan)
        if len(scan) < 2 or any(math.isnan(number(row, "gamma_5_15_m2_s")) for row in scan):
            continue
        true = [truth(row, side) for side, row in enumerate(scan)]
        away = [number(row, "gamma_5_15_m2_s") - t for row, t in zip(scan, true)]
        errors.append([100 * a / t for a, t in zip(away, true)])
        scaled += [a / number(row, "gamma_5_15_std_m2_s") for a, row in zip(away, scan)]
        for side in range(2):
            scatter[side].append(number(scan[side], "gamma_m2_s"))
    if len(errors) < 2:
        print(f"| {case} | {program} | {len(errors)} of {count} | - | - | - | - | - | {shown} | {seconds / count:.2f} |", flush=True)
        return
    means = [sum(pair) / 2 for pair in errors]
    bias = sum(means) / len(means)
    spread = math.sqrt(sum((m - bias) ** 2 for m in means) / (len(means) - 1) / len(means))
    over = "-"
    if bounds:
        def deviation(values):
            middle = sum(values) / len(values)
            return math.sqrt(sum((v - middle) ** 2 for v in values) / (len(values) - 1))

        over = f"{sum(deviation(s) / b for s, b in zip(scatter, bounds)) / 2:.2f}"
    finite = [s for s in scaled if math.isfinite(s)]
    within = [sum(abs(s) <= limit for s in finite) / len(finite) for limit in (1, 2)]
    root = math.sqrt(sum(s * s for s in finite) / len(finite))
    print(
        f"| {case} | {program} | {len(errors)} of {count} | {bias:.2f} ± {spread:.2f} % | {over} | {root:.2f} "
        f"| {within[0]:.2f} | {within[1]:.2f} | {shown} | {seconds / count:.2f} |",
        flush=True,
    )


def of_files(case, name, options, programs, scans, seed, folder, **kind):
    truth_m2_s, bounds, gate_std_m = MAPS[name]
    folder.mkdir(parents=True, exist_ok=True)
    files = noisy(name, scans, seed, folder, **kind)
    for program, path in programs:
        out = folder / program
        seconds = called(path, "retrieve", *files, "--gate-std", gate_std_m, *options, "--out", out, "--overwrite")
        by_scan = {}
        for row in rows(out):
            by_scan.setdefault(row["scan"], []).append(row)
        pairs = [[row for side in ("left", "right") for row in scan if row["side"] == side] for scan in by_scan.values()]
        table(case, program, pairs, lambda row, side: truth_m2_s[side], None if kind else bounds, scans, seconds)


def of_scene(case, flow, programs, scans, seed, folder, snr_db, secondary):
    folder.mkdir(parents=True, exist_ok=True)
    scene = folder / "scene.toml"
    scene.write_text(SCENE.format(seed=seed, scans=scans, flow=flow, snr_db=snr_db, secondary=secondary))
    for program, path in programs:
        out = folder / program
        seconds = called(path, "run", scene, "--out", out, "--overwrite")
        by_scan = {}
        for row in rows(out):
            by_scan.setdefault(row["realisation"], []).append(row)
        table(case, program, list(by_scan.values()), lambda row, side: number(row, "gamma_5_15_true_m2_s"), None, scans, seconds)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", action="append", required=True, help="NAME=PATH of a wakescope")
    parser.add_argument("--scans", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--folder", type=Path, default=ROOT / "target/fits")
    parser.add_argument("--only", nargs="*", default=[], help="some of the cases")
    parser.add_argument("--secondary", default="auto", help="of scenes: auto, never or always")
    options = parser.parse_args()
    programs = [program.split("=", 1) for program in options.program]
    common = (programs, options.scans, options.seed)
    planes = f'kind = "simulated"\nmotion = "frozen"\nplanes = "{REFERENCE}/wake/plane1"\n'
    turbulent = ("--turbulence", f"{TURBULENCE_M_S},{TURBULENCE_LENGTH_M}")
    cases = {
        "map a": lambda at: of_files("map a, points", "a", (), *common, at),
        "map b": lambda at: of_files("map b, long gates", "b", (), *common, at),
        "map c": lambda at: of_files("map c, moving", "c", (), *common, at),
        "outliers": lambda at: of_files("map a, 5 % outliers", "a", (), *common, at, outliers=OUTLIERS),
        "turbulence": lambda at: of_files("map a, turbulence", "a", turbulent, *common, at, turbulence=True),
        "low": lambda at: of_scene("low pair, 0 dB", LOW, *common, at, 0.0, options.secondary),
        "moving": lambda at: of_scene("moving pair, 10 dB", LOW + 'motion = "inviscid"\n', *common, at, 10.0, options.secondary),
        "stored 2.5": lambda at: of_scene("stored wake, τ = 2.5", planes + "age_tau = 2.5\n", *common, at, 10.0, options.secondary),
        "stored 4": lambda at: of_scene("stored wake, τ = 4", planes + "age_tau = 4.0\n", *common, at, 10.0, options.secondary),
    }
    wake = options.folder / "coarse_wake"
    coarse = f'kind = "simulated"\nmotion = "frozen"\nplanes = "{wake.resolve()}/plane1"\nage_tau = 4.0\n'
    cases["coarse"] = lambda at: of_scene("coarse wake, τ = 4", coarse, *common, at, 10.0, options.secondary)
    unknown = [name for name in options.only if name not in cases]
    if unknown:
        sys.exit(f"--only {unknown[0]}: none of {', '.join(cases)}")
    if options.scans < 2:
        sys.exit(f"--scans {options.scans}: at least 2, for a scatter")
    if (not options.only or "coarse" in options.only) and not (wake / "plane1_0001.nc").exists():
        options.folder.mkdir(parents=True, exist_ok=True)
        case = options.folder / "coarse.toml"
        case.write_text(COARSE)
        called(programs[-1][1], "wake", case, "--preset", "coarse", "--out", wake, "--overwrite")
    print("| case | program | pairs found | error of Γ | scatter / bound | error / stated | within 1 | within 2 | secondary | s a scan |")
    print("|---|---|---|---|---|---|---|---|---|---|")
    for name, case in cases.items():
        if not options.only or name in options.only:
            case(options.folder / name.replace(" ", "_"))


if __name__ == "__main__":
    main()
