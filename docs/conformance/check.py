#!/usr/bin/env python3
"""What programs make of the files of `cargo xtask conformance`: a Markdown table, file by client.

    python check.py DIR [--with PYTHON ...] [--client NAME ...] [--expected FILE [--write]]

Clients are those that this Python has (arm_pyart, xradar, wradlib, doppy, lidarwind; versions in `clients.txt` beside this file) and
`wakescope`, a program in the path or the environment variable WAKESCOPE_PROGRAM. `--with` names the Python of another environment, such
as that of lidarwind, which needs an xarray of its own. PASS, FAIL with the worst difference, ERROR with the message; a dash where a
client does not claim the format. With `--expected` the exit code is 1 if a verdict is not that of the table FILE.
"""
import argparse, contextlib, csv, importlib.metadata, io, json, os, shutil, subprocess, sys, tempfile, warnings
from pathlib import Path

import numpy as np

WIND = 2e-3  # m/s, of exact velocities
WIND_OF_SIGNALS = 0.15  # m/s, where a client states no error
UNIT_FILE = 3e-7  # of single precision, of the value; and of six decimals of the truth:
DECIMALS = 1.6e-6


class Bad(Exception):
    """A difference beyond its tolerance, or what a client cannot show."""


def is_halo(name):
    return name.endswith(".hpl")


class Truth:
    def __init__(self, top, name):
        stem = name if is_halo(name) else name.split(".")[0]
        self.name = name
        for key, value in json.loads((top / f"{stem}.truth.json").read_text()).items():
            setattr(self, key, value)
        cells = np.loadtxt(top / f"{stem}.truth.csv", delimiter=",", skiprows=1, ndmin=2)
        self.gates = self.gates_before + len(self.range_m)
        self.velocity = np.full((len(self.time_s), self.gates), np.nan)
        self.velocity[cells[:, 0].astype(int), cells[:, 1].astype(int)] = cells[:, 2]
        self.elevation_deg, self.azimuth_deg = np.array(self.elevation_deg), np.array(self.azimuth_deg)
        self.range_m = np.array(self.range_m)
        self.is_of_signals = any(word in name for word in ("noise", "vad_eddies", "rhi_wake_eddies", "rhi_empty"))
        # The sweeps of a WindCube are cycles of one group.
        self.sweeps = 1 if name.endswith(".wc.nc") else len(self.sweep_modes)

    def wind_at(self, height_m, method=None):
        """North, east, up at heights: of the air, or what a method makes of it."""
        own = self.wind.get(method) or self.wind
        return np.array([np.interp(height_m, self.wind["height_m"], own[c]) for c in ("north_m_s", "east_m_s", "up_m_s")])

    def wind_of_true_velocities(self, gate):
        """What least squares make of the true velocities of a gate: the reference of signals, whose turbulence no method removes."""
        el, az = np.radians(self.elevation_deg), np.radians(self.azimuth_deg)
        beams = np.stack([np.cos(el) * np.cos(az), np.cos(el) * np.sin(az), np.sin(el)], -1)
        return np.linalg.lstsq(beams, self.velocity[:, self.gates_before + gate], rcond=None)[0]


def within(what, off, allowed, unit):
    off = float(np.max(np.abs(off)))
    if not off <= allowed:
        raise Bad(f"{what} {off:.3g} {unit}")


def check_read(truth, rays):
    """Holds what a client reads against the truth: velocity [ray, gate], azimuth, elevation, range, time, sweeps."""
    halo, count = is_halo(truth.name), len(truth.time_s)
    velocity = np.ma.filled(np.ma.asarray(rays["velocity"], float), np.nan)
    if velocity.shape[0] != count:
        raise Bad(f"{velocity.shape[0]} of {count} rays")
    if velocity.shape[1] != truth.gates:
        raise Bad(f"{velocity.shape[1]} of {truth.gates} gates")
    if rays.get("sweeps", truth.sweeps) != truth.sweeps:
        raise Bad(f"{rays['sweeps']} of {truth.sweeps} sweeps")
    velocity, want = velocity[:, truth.gates_before :], truth.velocity[:, truth.gates_before :].copy()
    for ray, gate in truth.missing:
        want[ray, gate] = np.nan
    if (np.isnan(velocity) != np.isnan(want)).any():
        raise Bad(f"{int((np.isnan(velocity) != np.isnan(want)).sum())} values missing that are not, or the reverse")
    off = velocity - want
    nyquist = np.array(truth.nyquist_m_s)[np.array(truth.sweep)][:, None]
    if nyquist.min() < 10:
        off = off - 2 * nyquist * np.round(off / (2 * nyquist))
    if not truth.is_of_signals:
        allowed = 5.1e-5 if halo else UNIT_FILE * np.nanmax(np.abs(want)) + DECIMALS
        within("velocity", off[np.isfinite(off)], allowed, "m/s")
    within("range", np.asarray(rays["range"], float)[truth.gates_before :] - truth.range_m, 0.01, "m")
    within("elevation", np.asarray(rays["elevation"], float) - truth.elevation_deg, 5.1e-3 if halo else 1e-5, "degrees")
    turn = np.asarray(rays["azimuth"], float) - truth.azimuth_deg
    within("azimuth", turn - 360 * np.round(turn / 360), 5.1e-3 if halo else 1e-5, "degrees")
    time_s = np.asarray(rays["time"])
    if time_s.dtype.kind == "M":
        time_s = (time_s - np.datetime64(truth.start_utc[:-1])) / np.timedelta64(1, "ns") * 1e-9
    want_s = np.array(truth.time_s)
    if truth.name.endswith(".wc.nc"):  # the ends of the rays
        want_s = want_s + 0.5 * np.median(np.diff(want_s))
    within("time", np.array([time_s[0] - want_s[0], time_s[-1] - want_s[-1]]), 4e-3 if halo else 1e-3, "s")


def check_cut(truth, read):
    """A file that ends too early must be refused; of a HALO file the rays before the cut are right, too."""
    try:
        velocity = np.ma.filled(np.ma.asarray(read()["velocity"], float), np.nan)
    except Exception:
        return
    if is_halo(truth.name) and len(velocity) <= 32:
        return
    want = truth.velocity[: len(velocity)]
    wrong = int((np.abs(velocity - want) > 1e-3).sum())
    raise Bad(f"opened; {wrong} of {want.size} velocities wrong, {int((velocity == 0).sum())} of them 0")


def check_wind(truth, height_m, found, method="sine_fit"):
    """Holds north, east and, if a client has it, up over the heights above the lidar against the truth."""
    found = np.ma.filled(np.ma.asarray(found, float), np.nan)
    has_wind = np.isfinite(found).all(axis=0)
    lacking = f"{int((~has_wind).sum())} of {len(has_wind)} heights without a wind"
    if not has_wind.any():
        raise Bad(lacking)
    if truth.is_of_signals:
        gates = [int(np.argmin(np.abs(truth.range_m * np.sin(np.radians(truth.elevation_deg[0])) - h))) for h in height_m]
        want = np.array([truth.wind_of_true_velocities(gate) for gate in gates]).T
    else:
        want = truth.wind_at(height_m, method)
    off = (found - want[: len(found)])[:, has_wind]
    within("wind", off, WIND_OF_SIGNALS if truth.is_of_signals else WIND, "m/s" if has_wind.all() else f"m/s, {lacking}")
    if not has_wind.all():
        raise Bad(lacking)


# ---- clients: FILE -> rays, and FILES -> wind ---------------------------------------------------------------------


def of_sweeps(sweeps, names):
    """Rays of xarray datasets of sweeps, one after the other."""
    time, azimuth, elevation, range_, velocity = names
    join = lambda name: np.concatenate([np.asarray(sweep[name].values) for sweep in sweeps])
    return {"time": join(time), "azimuth": join(azimuth), "elevation": join(elevation), "velocity": join(velocity),
            "range": sweeps[0][range_].values, "sweeps": len(sweeps)}


CFRADIAL = ("time", "azimuth", "elevation", "range", "radial_velocity")


def pyart_radar(path):
    import pyart

    return pyart.io.read_cfradial(str(path))


def pyart_read(path):
    radar = pyart_radar(path)
    start = np.datetime64(radar.time["units"].split("since ")[1].rstrip("Z"))
    return {"time": start + (radar.time["data"] * 1e9).astype("timedelta64[ns]"), "azimuth": radar.azimuth["data"],
            "elevation": radar.elevation["data"], "range": radar.range["data"], "sweeps": radar.nsweeps,
            "velocity": radar.fields["radial_velocity"]["data"]}


def pyart_wind(method):
    def wind(truth, paths):
        import pyart

        radar, field = pyart_radar(paths[0]), "radial_velocity"
        if truth.nyquist_m_s[0] < 10:
            found = pyart.correct.dealias_region_based(radar, vel_field=field, nyquist_vel=truth.nyquist_m_s[0])
            found["data"], field = np.ma.asarray(found["data"]), "dealiased"
            radar.add_field(field, found)
        height_m = truth.range_m * np.sin(np.radians(truth.elevation_deg[0]))
        found = getattr(pyart.retrieve, method)(radar, field, z_want=height_m)
        check_wind(truth, height_m, [found.v_wind, found.u_wind])

    return wind


def xradar_read(path):
    import xradar

    name = path.name
    if name.endswith(".hpl"):
        tree, names = xradar.io.open_hpl_datatree(str(path)), (*CFRADIAL[:4], "mean_doppler_velocity")
    elif name.endswith(".cf2.nc"):
        tree, names = xradar.io.open_cfradial2_datatree(str(path), first_dim="time"), CFRADIAL
    else:
        tree, names = xradar.io.open_cfradial1_datatree(str(path), first_dim="time"), CFRADIAL
    sweeps = [tree[f"sweep_{i}"].to_dataset().load() for i in range(sum(child.startswith("sweep") for child in tree.children))]
    return of_sweeps(sweeps, names)


def wradlib_read(path):
    import wradlib  # noqa: F401, registers the engines
    import xarray

    sweeps = []
    for number in range(99):
        try:
            sweeps.append(xarray.open_dataset(path, engine="cfradial1", group=f"sweep_{number}", first_dim="time").load())
        except Exception:
            if not sweeps:
                raise
            break
    return of_sweeps(sweeps, CFRADIAL)


def doppy_read(path):
    import doppy

    raw = doppy.raw.HaloHpl.from_srcs([str(path)])[0]
    return {"time": raw.time, "azimuth": raw.azimuth, "elevation": raw.elevation, "velocity": raw.radial_velocity,
            "range": raw.radial_distance}


def doppy_wind(truth, paths):
    import doppy

    wind = doppy.product.Wind.from_halo_data([str(path) for path in paths])
    height_m = wind.height[truth.gates_before :]
    for turn in range(len(wind.time)):
        found = np.array([wind.meridional_wind[turn], wind.zonal_wind[turn], wind.vertical_wind[turn]])
        check_wind(truth, height_m, found[:, truth.gates_before :])
    before = [wind.zonal_wind[:, : truth.gates_before], wind.mask[:, : truth.gates_before]]
    if np.isfinite(before[0]).any() and not before[1].all():
        raise Bad("a wind where the gates have no signal")


LIDARWIND = "range measurement_height azimuth elevation radial_wind_speed radial_wind_speed_status cnr relative_beta".split()


def lidarwind_wind(truth, paths):
    import lidarwind

    merged = lidarwind.DbsOperations([str(paths[0])], LIDARWIND).merged_ds
    found = lidarwind.GetWindProperties5Beam(merged)
    to_rad = np.radians(np.asarray(found.hor_wind_dir.values, float) + 180)
    speed = np.asarray(found.hor_wind_speed.values, float)
    up = np.asarray(found.ver_wind_speed.values, float)
    wind = np.array([speed * np.cos(to_rad), speed * np.sin(to_rad)]).reshape(2, -1, len(truth.range_m))
    height_m = truth.range_m * np.sin(np.radians(truth.elevation_deg[0]))
    for profile in range(wind.shape[1]):
        check_wind(truth, height_m, wind[:, profile], "beam_swinging")
    within("up", up - truth.wind_at(np.zeros(1))[2], WIND, "m/s")


def lidarwind_variances(truth, paths):
    """Variances of the rays that it reads: its six-beam method takes the zenith from files of their own."""
    import lidarwind

    merged = lidarwind.DbsOperations([str(paths[0])], LIDARWIND).merged_ds
    azimuth, elevation = merged.azimuth.values, merged.elevation.values
    for beam in truth.variances:
        own = np.isclose(azimuth, beam["azimuth_deg"], atol=1e-3) & np.isclose(elevation, beam["elevation_deg"], atol=1e-3)
        found = merged.radial_wind_speed.values[own].var(axis=0)
        within("variance", 100 * (found / np.array(beam["variance_m2_s2"]) - 1), 1, "%")


PROGRAM = os.environ.get("WAKESCOPE_PROGRAM") or shutil.which("wakescope")


def wakescope(command, paths, *options):
    """Rows of the table of a command of this program."""
    with tempfile.TemporaryDirectory() as folder:
        words = [PROGRAM, command, *map(str, paths), *options, "--out", f"{folder}/out", "--quiet"]
        done = subprocess.run(words, capture_output=True, text=True)
        if done.returncode:
            raise RuntimeError(done.stderr.strip())
        table = Path(folder, "out", {"wind": "wind.csv", "retrieve": "retrieval.csv"}[command])
        return list(csv.DictReader(line for line in table.read_text().splitlines() if not line.startswith("#")))


def number(row, name):
    return float(row[name]) if row[name] else np.nan


def wakescope_wind(truth, paths):
    # A sweep that is folded alone does not tell its wind from the next one.
    every = ["--every", "600"] if "nyquist" in truth.name else []
    is_stare = truth.name.startswith("stare")
    for row in wakescope("wind", paths, "--gate-std", "0", *every):
        height_m = np.array([number(row, "height_m")])
        method = "beam_swinging" if truth.name.startswith("dbs") else "sine_fit"
        north, east, up = truth.wind_at(height_m, method)[:, 0]
        if is_stare:
            up = np.nanmean(truth.velocity[:, truth.gates_before + np.argmin(np.abs(truth.range_m - height_m))])
        by_errors = truth.dissipation_m2_s3 and not is_stare or truth.is_of_signals or "vertical_taken_as_zero" in row["flags"]
        for name, want in (("east", east), ("north", north), ("up", up), ("along", east)):
            found = number(row, f"{name}_m_s")
            if np.isfinite(found):
                # Turbulence has hundreds of winds, of which one may be beyond three standard errors.
                errors = (4 if truth.dissipation_m2_s3 else 3) if by_errors else 0
                allowed = WIND + (errors * number(row, f"{name}_std_m_s") if errors else 0)
                within(name, found - want, allowed, "m/s")


def wakescope_vortices(truth, paths):
    own = truth.is_of_signals
    rows = wakescope("retrieve", paths, *([] if own else ["--gate-std", "0"]))
    found = [row for row in rows if row["side"] != "none"]
    if len(found) != len(truth.vortices):
        raise Bad(f"{len(found)} of {len(truth.vortices)} vortices")
    least_m = 0.035 if is_halo(truth.name) else 1e-3  # of angles of two decimals at 400 m
    for row, vortex in zip(found, truth.vortices):
        for value, deviation, least in (("y_m", "y_std_m", least_m), ("z_m", "z_std_m", least_m),
                                        ("gamma_5_15_m2_s", "gamma_5_15_std_m2_s", 10 * least_m)):
            within(value, number(row, value) - vortex[value], 3 * number(row, deviation) + least, "")


def wakescope_check(truth, paths):
    if "cut" in truth.name:
        return check_cut(truth, lambda: {"velocity": np.zeros(truth.velocity.shape), "rows": wakescope("retrieve", paths)})
    is_wake = truth.name.startswith("rhi") and "nyquist" not in truth.name
    return wakescope_vortices(truth, paths) if is_wake else wakescope_wind(truth, paths)


def reads(read, *endings):
    """A client that reads files of these endings."""
    def check(truth, paths):
        for path in paths:
            own = truth if path.name == truth.name else Truth(path.parent, path.name)
            check_cut(own, lambda: read(path)) if "cut" in path.name else check_read(own, read(path))
    return check, lambda name: format_of(name) in endings


def format_of(name):
    return next(ending for ending in (".cf2.nc", ".wc.nc", ".nc", ".hpl", ".csv") if name.endswith(ending))


def is_cone(name):
    return name.startswith("vad") and format_of(name) == ".nc"


CLIENTS = {  # name: (package, check, which files it claims)
    "wakescope": (None, wakescope_check, lambda name: True),
    "Py-ART": ("arm_pyart", *reads(pyart_read, ".nc")),
    "Py-ART vad_browning": ("arm_pyart", pyart_wind("vad_browning"), is_cone),
    "Py-ART vad_michelson": ("arm_pyart", pyart_wind("vad_michelson"), is_cone),
    "xradar": ("xradar", *reads(xradar_read, ".nc", ".cf2.nc", ".hpl")),
    "wradlib": ("wradlib", *reads(wradlib_read, ".nc")),
    "doppy": ("doppy", *reads(doppy_read, ".hpl")),
    "doppy Wind": ("doppy", doppy_wind, lambda name: name.startswith("vad") and is_halo(name)),
    "lidarwind": ("lidarwind", lambda truth, paths: (lidarwind_variances if truth.variances else lidarwind_wind)(truth, paths),
                  lambda name: name.endswith(".wc.nc")),
}


def version_of(client):
    """The version of a client that is here; None without it."""
    package = CLIENTS[client][0]
    if package is None:
        return PROGRAM and subprocess.run([PROGRAM, "--version"], capture_output=True, text=True).stdout.split()[-1]
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return None


def cases(top):
    """Files by the numbers of their cases."""
    files = {}
    with open(top / "manifest.csv", newline="") as table:
        for row in csv.DictReader(table):
            if row["format"] != "truth":
                files.setdefault(int(row["case"]), []).append(row["file"])
    return dict(sorted(files.items()))


def verdict(check, top, names):
    try:
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
            check(Truth(top, names[0]), [top / name for name in names])
    except Bad as bad:
        return f"FAIL {bad}"
    except Exception as error:
        return f"ERROR {type(error).__name__}: {' '.join(str(error).split())[:60]}"
    return "PASS"


def judged(top, wanted):
    """Versions of the clients that are here, and their verdicts by file."""
    versions, verdicts = {}, {}
    for client, (_, check, claims) in CLIENTS.items():
        version = version_of(client) if not wanted or client in wanted else None
        if not version:
            continue
        versions[client] = version
        for names in cases(top).values():
            if claims(names[0]):
                verdicts.setdefault(names[0], {})[client] = verdict(check, top, names)
    return versions, verdicts


def markdown(top, versions, verdicts):
    lines = ["| file | " + " | ".join(f"{client} {versions[client]}" for client in versions) + " |", "|---" * (len(versions) + 1) + "|"]
    for number, names in cases(top).items():
        of_file = verdicts.get(names[0], {})
        label = f"{number} `{names[0]}`" + (f" to `_{len(names)}`" if len(names) > 1 else "")
        cells = [of_file.get(client, "–").replace("|", "/") for client in versions]
        lines.append(f"| {label} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def against(expected, versions, verdicts, write):
    """Names of the verdicts that are not those of a table: `file,client,verdict`, of those that are no PASS; only the word counts."""
    found = [(name, client, text) for name, row in verdicts.items() for client, text in row.items() if text != "PASS"]
    if write:
        with open(expected, "w", newline="") as table:
            csv.writer(table, lineterminator="\n").writerows([("file", "client", "verdict"), *found])
        return []
    with open(expected, newline="") as table:
        known = {(row["file"], row["client"]): row["verdict"].split()[0] for row in csv.DictReader(table)}
    wrong = []
    for name, row in verdicts.items():
        for client, text in row.items():
            want = known.get((name, client), "PASS")
            if text.split()[0] != want:
                wrong.append(f"{name}, {client}: {text}; expected {want}")
    return wrong


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--with", dest="others", action="append", default=[], help="Python of another environment")
    parser.add_argument("--client", action="append", default=[], help="only this client, which must be there")
    parser.add_argument("--expected", type=Path, help="table of known verdicts")
    parser.add_argument("--write", action="store_true", help="write that table")
    parser.add_argument("--json", action="store_true", help="print verdicts for another Python")
    words = parser.parse_args()
    warnings.simplefilter("ignore")
    os.environ["PYART_QUIET"] = "1"
    versions, verdicts = judged(words.folder, words.client)
    if words.json:
        print("\n" + json.dumps([versions, verdicts]))
        return 0
    for python in words.others:
        command = [python, __file__, str(words.folder), "--json"] + [word for name in words.client for word in ("--client", name)]
        done = subprocess.run(command, capture_output=True, text=True, check=True)
        more, further = json.loads(done.stdout.strip().splitlines()[-1])
        for client in more.keys() - versions.keys():
            versions[client] = more[client]
            for name, row in further.items():
                if client in row:
                    verdicts.setdefault(name, {})[client] = row[client]
    lacking = [name for name in words.client if name not in versions]
    if lacking:
        sys.exit(f"check.py: lacking is {', '.join(lacking)}")
    versions = {client: versions[client] for client in CLIENTS if client in versions}
    print(markdown(words.folder, versions, verdicts))
    wrong = against(words.expected, versions, verdicts, words.write) if words.expected else []
    for text in wrong:
        print(f"check.py: {text}", file=sys.stderr)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
