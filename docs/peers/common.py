"""What the scripts of this folder share: processor time, the smallest of several, the file of results."""
import csv
import datetime
import pathlib
import platform
import resource
import subprocess

FOLDER = pathlib.Path(__file__).resolve().parent
ROOT = FOLDER.parent.parent
REFERENCE = ROOT / "tests" / "reference"
COLUMNS = ["panel", "method", "version", "value", "error", "standard_error", "cpu_s"]


def cpu_s():
    """Processor time of this process so far."""
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime


def fastest(work, repetitions=5, least_s=0.2):
    """Smallest mean processor time of a call, each mean over at least so long."""
    means = []
    for _ in range(repetitions):
        start, calls = cpu_s(), 0
        while cpu_s() - start < least_s:
            work()
            calls += 1
        means.append((cpu_s() - start) / calls)
    return min(means)


def numbers(path):
    """Rows of numbers of a reference file, without its comments and heads."""
    rows = []
    for line in open(path):
        cells = line.split(",")
        try:
            rows.append([float(cell) for cell in cells])
        except ValueError:
            continue
    return rows


def processor():
    for line in open("/proc/cpuinfo"):
        if line.startswith("model name"):
            return line.split(":")[1].strip()
    return platform.processor()


def write(name, rows):
    """Writes NAME.csv: rows of (panel, method, version, value, error, standard error, seconds)."""
    kernel = subprocess.run(["cargo", "xtask", "work-precision", "--kernel"], cwd=ROOT, capture_output=True, text=True, check=True)
    with open(FOLDER / f"{name}.csv", "w", newline="") as out:
        print(f"# {datetime.date.today()}, {processor()}, Python {platform.python_version()}, docs/peers/{name}.py", file=out)
        print(f"# kernel_s = {kernel.stdout.strip()}", file=out)
        table = csv.writer(out, lineterminator="\n")
        table.writerow(COLUMNS)
        for panel, method, version, *values in rows:
            table.writerow([panel, method, version, *(f"{value:.4g}" for value in values)])
            print(panel, method, version, *(f"{value:.4g}" for value in values), flush=True)
