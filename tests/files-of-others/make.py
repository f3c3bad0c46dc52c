"""Files as Python's libraries write them, with one truth: a scan of a vortex pair, samples of a uniform wind, or a linear wind field.

`python make.py FOLDER` writes them. The tests of the program read the ones that are stored here, `python/tests/test_files_of_others.py` new ones.
The bytes depend on the libraries (xarray, netCDF4, h5py, numpy); the values do not.
"""

import sys
from pathlib import Path

import h5py
import netCDF4
import numpy as np
import xarray

ELEVATION_DEG = np.arange(2.0, 14.01, 0.4)
RANGE_M = 308.0 + 8.0 * np.arange(28)
# 2024-01-31T12:01:00Z is the time of the first ray, and rays follow each other by 0.1 s.
STEP_S = 0.1
NYQUIST_M_S = (30.0, 7.5)


def velocity(elevation_deg=ELEVATION_DEG, wind=2.0):
    """Radial velocity of a pair of 400 m^2/s at 400 and 440 m, 45 m up, with its images, and of a wind, positive away, m/s."""
    elevation, range_m = np.meshgrid(np.radians(elevation_deg), RANGE_M, indexing="ij")
    y, z = range_m * np.cos(elevation), range_m * np.sin(elevation)
    v, w = np.full_like(y, wind), np.zeros_like(y)
    for y_m, circulation in ((400.0, -400.0), (440.0, 400.0)):
        for z_m, image in ((45.0, 1.0), (-45.0, -1.0)):
            square = (y - y_m) ** 2 + (z - z_m) ** 2 + 9.0
            v -= image * circulation / (2 * np.pi) * (z - z_m) / square
            w += image * circulation / (2 * np.pi) * (y - y_m) / square
    noise = 0.1 * np.random.default_rng(3).standard_normal(y.shape)
    return np.round(v * np.cos(elevation) + w * np.sin(elevation) + noise, 2)


def folded(values, nyquist):
    return (values + nyquist) % (2 * nyquist) - nyquist


class Scan:
    """Variables of a NetCDF file in the least form of CfRadial, each of which a case may replace."""

    def __init__(self, elevation_deg=ELEVATION_DEG, values=None):
        rays = len(elevation_deg)
        self.sizes = {"time": rays, "range": len(RANGE_M)}
        self.variables = {
            "time": ("time", "f8", STEP_S * np.arange(rays), {"units": "seconds since 2024-01-31T12:01:00Z"}),
            "range": ("range", "f4", RANGE_M, {"units": "meters"}),
            "azimuth": ("time", "f4", np.full(rays, 90.0), {"units": "degrees"}),
            "elevation": ("time", "f4", elevation_deg, {"units": "degrees"}),
            "VEL": ("time range", "f4", velocity() if values is None else values, {"units": "m/s"}),
        }

    def write(self, path, format="NETCDF3_CLASSIC"):
        with netCDF4.Dataset(path, "w", format=format) as file:
            for name, length in self.sizes.items():
                file.createDimension(name, length)
            for name, (dims, kind, values, attributes) in self.variables.items():
                attributes = dict(attributes)
                fill = attributes.pop("_FillValue", None)
                variable = file.createVariable(name, kind, tuple(dims.split()), fill_value=fill)
                variable.set_auto_maskandscale(False)
                variable.setncatts(attributes)
                variable[...] = values

    def dataset(self):
        variables = {name: (dims.split(), np.asarray(values, kind), attributes) for name, (dims, kind, values, attributes) in self.variables.items()}
        return xarray.Dataset({name: value for name, value in variables.items() if name not in self.sizes}, {name: variables[name] for name in self.sizes})


def unsigned_shorts_of_xarray(path):
    """Velocities and elevations in 16 bits that xarray marks as `_Unsigned`."""
    scan = Scan().dataset()
    codes = {"dtype": "int16", "_Unsigned": "true", "_FillValue": np.int16(-1)}
    packing = {
        "VEL": {**codes, "scale_factor": 0.01, "add_offset": -400.0},
        "elevation": {**codes, "scale_factor": 0.01, "add_offset": -400.0},
    }
    scan.to_netcdf(path, format="NETCDF3_64BIT", encoding=packing)


def unsigned_bytes_of_a_ratio(path):
    """A ratio of signal and noise in bytes without sign, dB, with limits in packed values: half the velocities are noise."""
    scan = Scan()
    noise = np.random.default_rng(8).random((scan.sizes["time"], len(RANGE_M))) < 0.3
    scan.variables["VEL"] = ("time range", "f4", np.where(noise, 19.0, velocity()), {"units": "m/s"})
    codes = np.where(noise, 20, 200).astype("u1").view("i1")
    attributes = {"units": "dB", "scale_factor": 0.25, "add_offset": -40.0, "_Unsigned": "true", "valid_range": np.array([1, -6], "i1")}
    scan.variables["snr"] = ("time range", "i1", codes, attributes)
    scan.write(path)


def nyquist_of_sweeps(path):
    """Two sweeps, written by xarray, with a Nyquist velocity each."""
    both = np.r_[ELEVATION_DEG, ELEVATION_DEG]
    scan = Scan(both, np.vstack([folded(velocity(), nyquist) for nyquist in NYQUIST_M_S]))
    rays = len(ELEVATION_DEG)
    data = scan.dataset()
    data["sweep_start_ray_index"] = ("sweep", np.array([0, rays], "i4"))
    data["sweep_end_ray_index"] = ("sweep", np.array([rays - 1, 2 * rays - 1], "i4"))
    data["nyquist_velocity"] = ("sweep", np.array(NYQUIST_M_S), {"units": "m/s"})
    data.to_netcdf(path, format="NETCDF4")


def nyquist_of_rays(path):
    """Each elevation is seen twice, with two repetition rates in turn; the Nyquist velocity is in cm/s."""
    values = np.stack([folded(velocity(), nyquist) for nyquist in NYQUIST_M_S], axis=1)
    scan = Scan(np.repeat(ELEVATION_DEG, 2), values.reshape(-1, len(RANGE_M)))
    scan.variables["nyquist_velocity"] = ("time", "f4", np.tile(100.0 * np.array(NYQUIST_M_S), len(ELEVATION_DEG)), {"units": "cm s-1"})
    scan.write(path)


def times_in_minutes(path):
    scan = Scan()
    units = {"units": "minutes since 2024-1-31 14:00:30.5 +0200"}
    scan.variables["time"] = ("time", "f8", (29.5 + STEP_S * np.arange(scan.sizes["time"])) / 60.0, units)
    scan.write(path)


def times_after_a_text(path):
    """A group as Windcube has it: the date is a string of the root, and times are those of the ends of rays."""
    with netCDF4.Dataset(path, "w") as file:
        file.createDimension("sweep", None)
        file.createVariable("time_reference", str, ())[...] = np.array("2024-01-31T12:01:00Z", dtype=object)
        group = file.createGroup("Sweep_7")
        for name, length in {"time": None, "range": len(RANGE_M)}.items():
            group.createDimension(name, length)
        for name, (dims, kind, values, attributes) in Scan().variables.items():
            variable = group.createVariable("radial_wind_speed" if name == "VEL" else name, kind, tuple(dims.split()), zlib=True)
            variable.setncatts({**attributes, **({"units": "seconds since time_reference"} if name == "time" else {})})
            variable[...] = values + (STEP_S / 2 if name == "time" else 0.0)
        group.createVariable("radial_wind_speed_status", "i1", ("time", "range"))[...] = 1


def types_that_are_not_needed(path):
    """Plain HDF5 with booleans, complex numbers and references beside the scan, checksums before the compression."""
    with h5py.File(path, "w") as file:
        for name, (_, _, values, _) in Scan().variables.items():
            options = {"fletcher32": True, "compression": "gzip", "chunks": True} if np.ndim(values) == 2 else {}
            file.create_dataset(name, data=values, **options)
        file["are_good"] = np.ones(len(ELEVATION_DEG), bool)
        file["spectrum"] = np.zeros(4, complex)
        file["reference"] = file["VEL"].ref


def dimensions_called_as_variables(path):
    """NetCDF-4 with dimensions that have the names of variables that do not run along them."""
    scan = Scan()
    scan.sizes.update(elevation=3, azimuth=4)
    scan.variables["places"] = ("elevation azimuth", "i2", np.zeros((3, 4)), {})
    scan.write(path, "NETCDF4")


def ranges_of_each_ray(path):
    """Ranges in km that xarray writes once for each ray."""
    scan = Scan()
    del scan.variables["range"]
    scan.sizes["gate"] = scan.sizes.pop("range")
    scan.variables["VEL"] = ("time gate", *scan.variables["VEL"][1:])
    rows = np.tile(RANGE_M / 1000.0, (scan.sizes["time"], 1))
    scan.variables["gate"] = ("gate", "i4", np.arange(len(RANGE_M)), {})
    data = scan.dataset()
    data["range"] = (("time", "gate"), rows, {"units": "km"})
    data.to_netcdf(path, format="NETCDF3_64BIT")


def angles_with_a_gap(path):
    """Elevations that count on below the horizon as 352 degrees, and a ray whose elevation is missing."""
    scan = Scan(np.r_[352.0, 356.0, ELEVATION_DEG, np.nan], np.vstack([np.full((2, 28), np.nan), velocity(), np.zeros((1, 28))]))
    scan.write(path)


def gates_before_rays(path):
    """Gates run slower than rays, in a dataset with a dimension of length 1, as xarray turns it."""
    Scan().dataset().transpose("range", "time").expand_dims("sweep").to_netcdf(path, format="NETCDF3_64BIT")


def ranges_of_the_root(path):
    """A sweep in a group of a group, beside one without velocities; the ranges are in the root."""
    with netCDF4.Dataset(path, "w") as file:
        file.createDimension("range", len(RANGE_M))
        scans = file.createGroup("scans")
        for sweep in ("sweep_0", "sweep_1"):
            group = scans.createGroup(sweep)
            group.createDimension("time", len(ELEVATION_DEG))
            for name, (dims, kind, values, attributes) in Scan().variables.items():
                if name == "range" and sweep == "sweep_1":
                    continue
                place = file if name == "range" else group
                if name != "VEL" or sweep == "sweep_1":
                    variable = place.createVariable(name, kind, tuple(dims.split()), zlib=True)
                    variable.setncatts(attributes)
                    variable[...] = values


def table_of_savetxt(path):
    rows = [(r, e, v) for e, row in zip(ELEVATION_DEG, velocity()) for r, v in zip(RANGE_M, row)]
    np.savetxt(path, rows, fmt="%.2f", header="range_m elevation_deg velocity_m_s")


def table_of_a_spreadsheet(path):
    """UTF-16, semicolons, decimal commas, capitals, ends of lines of Windows."""
    rows = ["Range (km);Elevation [deg];Radial_velocity [cm/s]"]
    for e, row in zip(ELEVATION_DEG, velocity()):
        rows += [f"{r / 1000:.3f};{e:.2f};{100 * v:.0f},0".replace(".", ",") for r, v in zip(RANGE_M, row)]
    Path(path).write_bytes("\r\n".join(rows).encode("utf-16"))


def wind(x, y, z):
    """A linear wind, m/s."""
    return 1.0 + 0.01 * z + 0 * x + 0 * y, 2.0 + 0.02 * z + 0.001 * y + 0 * x, -0.5 + 0.003 * x + 0 * y + 0 * z


def fields_of_cm1(path):
    """Half and full levels of CM1 in km, the levels from the top down, by xarray."""
    centre = 0.04 * (np.arange(12) + 0.5)
    face = 0.04 * np.arange(13)
    axes = {"xh": centre, "xf": face, "yh": centre, "yf": face, "zh": centre[::-1], "zf": face[::-1]}
    data = {}
    for i, (name, dims) in enumerate({"u": ("zh", "yh", "xf"), "v": ("zh", "yf", "xh"), "w": ("zf", "yh", "xh")}.items()):
        z, y, x = np.meshgrid(*(1000.0 * axes[dim] for dim in dims), indexing="ij")
        data[name] = (("time", *dims), wind(x, y, z)[i][None].astype("f4"), {"units": "m/s"})
    coordinates = {name: (name, values, {"units": "km"}) for name, values in axes.items()}
    coordinates["time"] = ("time", [0.0], {"units": "seconds since start"})
    xarray.Dataset(data, coordinates).to_netcdf(path, format="NETCDF3_64BIT")


def fields_of_wrf(path):
    """Two times of a wind that grows by 1 m/s along y in 10 s; the times are texts alone."""
    count, step = 12, 40.0
    with netCDF4.Dataset(path, "w", format="NETCDF4_CLASSIC") as file:
        file.DX, file.DY = step, step
        names = {"Time": None, "DateStrLen": 19, "west_east": count, "south_north": count, "bottom_top": count}
        for name, length in names.items():
            file.createDimension(name, length)
            if name.startswith(("west", "south", "bottom")):
                file.createDimension(name + "_stag", count + 1)
        times = ["2024-01-31_12:00:00", "2024-01-31_12:00:10"]
        file.createVariable("Times", "S1", ("Time", "DateStrLen"))[:] = np.array([list(text) for text in times], "S1")
        components = {"U": ("bottom_top", "south_north", "west_east_stag"), "V": ("bottom_top", "south_north_stag", "west_east")}
        components["W"] = ("bottom_top_stag", "south_north", "west_east")
        components |= {"PH": components["W"], "PHB": components["W"]}
        for name, dims in components.items():
            places = [step * (np.arange(count + 1) if dim.endswith("_stag") else np.arange(count) + 0.5) for dim in dims]
            z, y, x = np.meshgrid(*places, indexing="ij")
            values = {"PH": 0 * z, "PHB": 9.81 * z, **dict(zip("UVW", wind(x, y, z)))}[name]
            later = 1.0 if name == "V" else 0.0
            file.createVariable(name, "f4", ("Time", *dims), zlib=True)[:] = np.stack([values, values + later])


def echoes(complex_samples):
    """Records of a uniform wind of 5 m/s: seven lines of four pulses, as samples from -1 to 1."""
    count, rate, wavelength = 267, 250e6, 1.55e-6
    random = np.random.default_rng(1)
    normal = lambda *shape: (random.standard_normal(shape) + 1j * random.standard_normal(shape)) / np.sqrt(2)
    sigma = 200e-9 * rate / (2 * np.sqrt(np.log(2)))
    pulse = np.exp(-(np.arange(-120, 121) ** 2) / (2 * sigma**2))
    pulse /= np.sqrt((pulse**2).sum())
    frequency = -2 * 5.0 / wavelength + (0.0 if complex_samples else 80e6)
    echo = np.stack([np.convolve(normal(count + 240), pulse, "valid") for _ in range(28)])
    signal = echo * np.exp(2j * np.pi * frequency * np.arange(count) / rate)
    inside = abs(np.fft.fftfreq(count, 1 / rate) - (0.0 if complex_samples else 80e6)) < 25e6
    noise = np.fft.ifft(np.fft.fft(normal(28, count)) * inside)
    signal += noise * np.sqrt(0.1 / (abs(noise) ** 2).mean())
    return signal / (1.01 * max(abs(signal.real).max(), abs(signal.imag).max()))


def samples_of_a_byte(path):
    """In phase and quadrature as bytes without sign, by numpy."""
    signal = echoes(True)
    parts = np.stack([signal.real, signal.imag], axis=-1)
    np.save(path, np.round(128 + 127 * parts).astype("u1"))


def samples_of_twelve_bits(path):
    """In phase and quadrature from 0 to 4095 in 16 bits without sign, whose middle code is none of theirs."""
    signal = echoes(True)
    parts = np.stack([signal.real, signal.imag], axis=-1)
    np.save(path, np.round(2048 + 2000 * parts).astype("<u2"))


def samples_with_an_offset(path):
    """Currents in 16 bits with sign whose zero is the code 900, in NetCDF-4."""
    codes = np.round(900 + 4000 * echoes(False).real).astype("i2")
    with netCDF4.Dataset(path, "w") as file:
        file.createDimension("record", codes.shape[0])
        file.createDimension("sample", codes.shape[1])
        file.createVariable("current_a", "i2", ("record", "sample"), zlib=True, fill_value=False)[:] = codes


FILES = {
    "unsigned_shorts_of_xarray.nc": unsigned_shorts_of_xarray,
    "unsigned_bytes_of_a_ratio.nc": unsigned_bytes_of_a_ratio,
    "nyquist_of_sweeps.nc": nyquist_of_sweeps,
    "nyquist_of_rays.nc": nyquist_of_rays,
    "times_in_minutes.nc": times_in_minutes,
    "times_after_a_text.nc": times_after_a_text,
    "types_that_are_not_needed.nc": types_that_are_not_needed,
    "dimensions_called_as_variables.nc": dimensions_called_as_variables,
    "ranges_of_each_ray.nc": ranges_of_each_ray,
    "angles_with_a_gap.nc": angles_with_a_gap,
    "gates_before_rays.nc": gates_before_rays,
    "ranges_of_the_root.nc": ranges_of_the_root,
    "table_of_savetxt.csv": table_of_savetxt,
    "table_of_a_spreadsheet.csv": table_of_a_spreadsheet,
    "fields_of_cm1.nc": fields_of_cm1,
    "fields_of_wrf.nc": fields_of_wrf,
    "samples_of_a_byte.npy": samples_of_a_byte,
    "samples_of_twelve_bits.npy": samples_of_twelve_bits,
    "samples_with_an_offset.nc": samples_with_an_offset,
}


def make(folder):
    for name, write in FILES.items():
        write(str(Path(folder) / name))
    rows = [f"{float(r)!r},{e:.1f},{float(v)!r}\n" for e, row in zip(ELEVATION_DEG, velocity()) for r, v in zip(RANGE_M, row)]
    (Path(folder) / "truth.csv").write_text("range_m,elevation_deg,velocity_m_s\n" + "".join(rows))


if __name__ == "__main__":
    make(sys.argv[1])
