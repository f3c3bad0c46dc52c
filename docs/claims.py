"""Computes what the claims measured again from the tables of a report.

python3 docs/claims.py [target/figures]

Needs nothing but Python. Each function below is named by its claim and gives words that `measured` of claims.csv must contain; figures that
the report lacks are left out. What is read off programs rather than tables (F4e, F5, F16, F19b) is not here.
"""

import csv
import math
import re
import sys
from pathlib import Path

FOLDER = Path(sys.argv[1] if len(sys.argv) > 1 else "target/figures")
NAN = math.nan


def rows(name):
    """Rows of a table; numbers where they are numbers, empty places NaN."""

    def value(text):
        try:
            return float(text) if text else NAN
        except ValueError:
            return text

    with open(FOLDER / f"{name}.csv", encoding="utf-8") as file:
        table = csv.DictReader(line for line in file if not line.startswith("#"))
        return [{key: value(text) for key, text in row.items()} for row in table]


def mean(values, without=None):
    kept = [value for place, value in enumerate(values) if place != without]
    return sum(kept) / len(kept)


def estimate(batches, function):
    """A number from all batches and its standard error from leaving out one at a time."""
    without = [function(batch) for batch in range(batches)]
    middle = mean(without)
    error = math.sqrt((batches - 1) / batches * sum((x - middle) ** 2 for x in without))
    return function(None), error


def words(found, factor=1.0):
    """As the report writes a number with its standard error: two digits of the error."""
    value, error = factor * found[0], abs(factor) * found[1]
    if math.isnan(value):
        return "not known"
    decimals = min(max(int(1 - math.floor(math.log10(error))), 0), 12) if error > 0 and math.isfinite(error) else 3
    return f"{value:.{decimals}f} ± {error:.{decimals}f}"


class Zones:
    """Zones of a table of batches: rms of (case, zone, place) without one batch."""

    def __init__(self, name):
        self.sums, self.range_m, self.lines = {}, {}, {}
        for row in rows(name):
            key = (row["case"], row["zone"], None if row["place"] != row["place"] else row["place"])
            self.sums.setdefault(key, []).append((row["sum_of_squares_m2_s2"], row["estimates"]))
            self.range_m[key] = row["range_m"]

    def rms(self, key, without=None):
        kept = [of for batch, of in enumerate(self.sums[key]) if batch != without]
        estimates = sum(of[1] for of in kept)
        return math.sqrt(sum(of[0] for of in kept) / estimates) if estimates else NAN

    def evolution(self, case, range_m, without):
        if (case, without) not in self.lines:
            self.lines[case, without] = self.line(case, without)
        x, y, slope = self.lines[case, without]
        return y + slope * (range_m - x)

    def line(self, case, without):
        """The straight line through what a case errs outside, each gate with the weight of its estimates."""
        gates = [key for key in self.sums if key[:2] == (case, "evolution")]
        points = []
        for key in gates:
            weight = sum(of[1] for batch, of in enumerate(self.sums[key]) if batch != without)
            if weight:
                points.append((self.range_m[key], self.rms(key, without), weight))
        weight = sum(p[2] for p in points)
        x, y = (sum(p[2] * p[k] for p in points) / weight for k in (0, 1))
        slope = sum(p[2] * (p[0] - x) * (p[1] - y) for p in points) / sum(p[2] * (p[0] - x) ** 2 for p in points)
        return x, y, slope

    def excess(self, key, without=None):
        return self.rms(key, without) - self.evolution(key[0], self.range_m[key], without)

    def across(self, case, without=None):
        keys = sorted((key for key in self.sums if key[:2] == (case, "across")), key=lambda key: key[2])
        return [(key[2], self.excess(key, without)) for key in keys]

    def batches(self, case):
        return max(len(of) for key, of in self.sums.items() if key[0] == case)

    def cases(self, start):
        return list(dict.fromkeys(key[0] for key in self.sums if key[0].startswith(start)))


def peak(across):
    inside = [k for k, point in enumerate(across) if abs(point[0]) <= 8.0]
    # of equal ones the last, as the program takes it
    top = max(inside, key=lambda k: (across[k][1], k))
    return top, across[top][1]


def width(across):
    top, value = peak(across)

    def end(step):
        k = top
        while 0 <= k + step < len(across):
            (x0, y0), (x1, y1) = across[k], across[k + step]
            if y1 < 0.5 * value:
                return x0 + (x1 - x0) * (y0 - 0.5 * value) / (y0 - y1)
            k += step
        return NAN

    return end(1) - end(-1)


def of_methods(zones, unit, function):
    """CA less each PA at the chapter's reference."""
    told = []
    for ca in zones.cases("CA; chapter"):
        case = ca.removeprefix("CA; ")
        pulse = case.rpartition(", ")[2]
        for pa in ("PA", "PA, Gaussian"):
            found = estimate(zones.batches(ca), lambda b: function(ca, b) - function(f"{pa}; {case}", b))
            told.append(f"{pulse}, CA less {pa}: {words(found)}{unit}")
    return told


def f13():
    zones = Zones("fig13.batches")
    return of_methods(zones, " m/s", lambda case, b: zones.excess((case, "inside", None), b))


def f14a():
    zones = Zones("fig14.batches")
    return of_methods(zones, " m/s", lambda case, b: peak(zones.across(case, b))[1])


def f14b():
    zones = Zones("fig14.batches")
    return of_methods(zones, " m", lambda case, b: width(zones.across(case, b)))


def shares(zones, pairs):
    """How far the first of two zones is from the second, in per cent."""
    share = lambda a, c: estimate(zones.batches(a[0]), lambda b: zones.rms(a, b) / zones.rms(c, b) - 1.0)
    return [words(share(a, c), 100.0) + " %" for a, c in pairs]


def f12a():
    zones = Zones("fig12.batches")
    # half of what guesses all over a band of 50 MHz err
    limit = 0.5 * 0.5 * 1.55e-6 * 50e6 / math.sqrt(12.0)
    cases = [c for c in zones.cases("chapter") if zones.rms((c, "outside", None)) < limit]
    steps = [((b, "outside", None), (a, "outside", None)) for a, b in zip(cases, cases[1:])]
    halves = [((c, "outside, near half", None), (c, "outside, far half", None)) for c in cases]
    return shares(zones, steps + halves)


def f12b():
    zones = Zones("fig12.batches")
    *cases, last = zones.cases("chapter")
    return shares(zones, [((c, "inside", None), (last, "inside", None)) for c in cases])


def f12c():
    zones = Zones("fig12.batches")
    cases = ("physical; 150 uJ", "physical, half the backscatter; 300 uJ")
    full, thin = ([zones.rms((case, zone, None)) for zone in ("inside", "outside")] for case in cases)
    differs = sum(abs(b / a - 1.0) for a, b in zip(full, thin))
    return ["together: " + (f"{differs:.0e}".replace("e-0", "e-") if differs else "0e0")]


def of_figure_25(case, snr_db, pa="PA", zone="inside"):
    zones = Zones("fig25.batches")
    key = lambda method: (f"{method}; {case}; {snr_db} dB", zone, None)
    return lambda b: zones.rms(key("CA"), b) / zones.rms(key(pa), b) - 1.0


def estimate_of_figure_25(function):
    zones = Zones("fig25.batches")
    return words(estimate(zones.batches(next(iter(zones.sums))[0]), function))


def share_words(*of):
    return estimate_of_figure_25(of_figure_25(*of))


WAKE, PAIR = "wake, band noise, one pulse a line", "pair, core {} b₀, band noise, one pulse a line"


def cp1():
    white, band = of_figure_25("wake, white noise, one pulse a line", -10), of_figure_25(WAKE, -10)
    return [estimate_of_figure_25(lambda b: white(b) - band(b))]


def cp2():
    return [share_words(case, 20) for case in (WAKE, PAIR.format(0.05))]


def cp3():
    large, small = (of_figure_25(PAIR.format(core), 0) for core in (0.15, 0.05))
    return [estimate_of_figure_25(lambda b: large(b) - small(b))]


def cp4():
    return [share_words(case, 0, "PA", "outside") for case in (WAKE, PAIR.format(0.05))]


def cp5():
    return [share_words(WAKE + ", raw bins", 0, pa) for pa in ("PA", "PA, Gaussian")]


def cp6():
    return [share_words("wake, band noise, eight pulses a line", -10, pa) for pa in ("PA", "PA, Gaussian")]


def t1():
    return [", ".join(f"{row['separation_m'] / 70.0:.1f}" for row in rows("tab01")) + " s"]


def f1b():
    core, spacing = 2.35, 47.0
    beyond = [r for r in rows("fig01") if abs(abs(r["y_m"]) - 0.5 * spacing) > 5.0 * core]
    return [f"{100.0 * max(abs(r['w_m_s'] / r['w_potential_m_s'] - 1.0) for r in beyond):.2f} %"]


def curves():
    found = {}
    for row in rows("fig04"):
        found.setdefault(row["configuration"], []).append(row)
    return found


def difference(a, b):
    return a["efficiency"] - b["efficiency"], math.hypot(a["efficiency_standard_error"], b["efficiency_standard_error"])


def f4a():
    of = curves()
    ratio = [e["efficiency"] / f["efficiency"] for e, f in zip(of["bistatic_1e-13_exact"], of["free_space"])]
    return [f"{ratio[0]:.3f} to {ratio[-1]:.3f}"]


def f4b():
    of = curves()
    pairs = zip(of["monostatic_1e-13"], of["bistatic_1e-13"])
    found = [(a["range_m"], difference(a, b)) for a, b in pairs if a["range_m"] >= 300.0]
    at, least = min(found, key=lambda of: of[1][0] / of[1][1])
    return [f"least sure at {at:g} m: {words(least)}"]


def f4c():
    of = curves()
    pairs = list(zip(of["monostatic_1e-13"], of["monostatic_1e-15"]))
    a, b = max(pairs, key=lambda pair: difference(*pair)[0])
    db = 10.0 * math.log10(a["efficiency"] / b["efficiency"])
    return [f"at {a['range_m']:g} m: {words(difference(a, b))}, {db:.1f} dB"]


def f4d():
    of = curves()
    excess = [(a["range_m"], difference(a, b)[0]) for a, b in zip(of["monostatic_1e-13"], of["monostatic_1e-15"])]
    best = max(range(len(excess)), key=lambda k: excess[k][1])
    after = [k for k in range(best, len(excess)) if excess[k][1] < 0.0]
    return [f"between {excess[after[0] - 1][0]:g} and {excess[after[0]][0]:g} m" if after else "none out to"]


def f6a():
    early = [r for r in rows("fig06") if r["tau"] <= 2.0]
    told = []
    for side in ("left", "right"):
        values = [(abs(r[f"secondary_gamma_{side}"]), r["tau"]) for r in early]
        told.append(f"{max(v for v, _ in values if v == v):.2f} Γ₀")
    return told


def f6b():
    table = rows("fig06")
    at = lambda tau: min(table, key=lambda r: abs(r["tau"] - tau))
    # first and last short mode, as the claim tells them
    first, last = (int(n) for n in re.search(r"modes (\d) to (\d) of the box", MEASURED["F6b"]).groups())
    short = lambda tau: sum(at(tau)[f"energy_mode_{m}"] for m in range(first, last + 1))
    whole = lambda tau: sum(at(tau)[f"energy_mode_{m}"] for m in range(1, 9))
    told = [f"grow at {0.5 * math.log(short(2.0) / short(1.0)):.2f} per tau"]
    return told + [f"{short(2.0) / whole(2.0):.2f} at 2"]


def f7d():
    table = rows("fig07")
    middle = lambda r, name, sign: 0.5 * (sign * r[f"{name}_left"] + r[f"{name}_right"])
    turned = [r["tau"] for r in table if r["tau"] > 0.1 and middle(r, "outward_shear", 1.0) < -0.01 * r["wall_shear"]]
    before = [r for r in table if r["tau"] <= turned[0]]
    lag = max(
        math.hypot(middle(r, "y", -1.0) - r["y_inviscid"], middle(r, "z", 1.0) - r["z_inviscid"]) for r in before
    )
    return [f"until tau = {turned[0]:.2f}", f"{lag:.4f} b₀ at equal times"]


def f7e():
    table = rows("fig07")
    z = lambda r: 0.5 * (r["z_left"] + r["z_right"])
    lowest = min((r for r in table if r["tau"] < 2.0), key=z)
    return [f"lowest {z(lowest):.3f} at tau = {lowest['tau']:.2f}"]


def f8():
    ratio = lambda pick: pick(r["v_exact_m_s"] for r in rows("fig08") if r["tau"] > 4.0) / pick(
        r["v_exact_m_s"] for r in rows("fig08") if r["tau"] < 4.0
    )
    finite = lambda pick: lambda values: pick(v for v in values if v == v)
    return [f"{ratio(finite(min)):.2f} and {ratio(finite(max)):.2f}"]


def f9b():
    here = sorted((r for r in rows("fig09") if abs(r["range_m"] - 400.0) < 1e-6), key=lambda r: r["rho_m"])
    unique = list({r["rho_m"]: r for r in here}.values())
    levels, n_eff = (", ".join(format(r[name], form) for r in unique) for name, form in (("level", ".0f"), ("n_eff", ".1f")))
    return [f"{levels} (as good as {n_eff} independent ones)"]


def f10():
    table = [r for r in rows("fig10") if r["snr_reference"] == "chapter"]
    lines = {}
    for row in table:
        lines.setdefault(row["elevation_rad"], []).append(row)
    pairs = []
    for line in lines.values():
        for a, b, c in zip(line, line[1:], line[2:]):
            gradient = abs((c["v_exact_m_s"] - a["v_exact_m_s"]) / (c["range_m"] - a["range_m"]))
            if math.isfinite(gradient + b["rms_m_s"]):
                pairs.append((b["rms_m_s"], gradient))
    x, y = (mean([p[k] for p in pairs]) for k in (0, 1))
    sums = [sum(f(p) for p in pairs) for f in (lambda p: (p[0] - x) ** 2, lambda p: (p[0] - x) * (p[1] - y), lambda p: (p[1] - y) ** 2)]
    decimals = len(str(MEASURED["F10"]).split(" ")[0].partition(".")[2])
    return [f"{sums[1] / math.sqrt(sums[0] * sums[2]):.{decimals}f}"]


def retrieved(flow, method):
    """Bias of the circulation in per cent over scans, both vortices of a scan together."""
    scans = {}
    for row in rows("fig17"):
        if row["flow"] == flow and row["method"] == method and row["gamma_m2_s"] == row["gamma_m2_s"]:
            scans.setdefault(row["scan"], []).append(100.0 * (row["gamma_m2_s"] / row["gamma_true_m2_s"] - 1.0))
    values = [mean(of) for of in scans.values()]
    return [words(estimate(len(values), lambda b: mean(values, b))) + " %"]


def of_maps(method):
    table = [r for r in rows("fig17") if r["method"] == method and r["vortex"] == "left"]
    first = [r for r in table if r["snr_db"] == table[0]["snr_db"]]
    squares = [(100.0 * (r["gamma_m2_s"] / r["gamma_true_m2_s"] - 1.0)) ** 2 for r in first]
    return [words(estimate(len(squares), lambda b: math.sqrt(mean(squares, b)))) + " %"]


def likelihood(pulses, low_db, high_db):
    return [
        r
        for r in rows("fig18")
        if r["estimator"] == "likelihood" and r["n_pulses"] == pulses and r["pulse_s"] == 2e-7 and low_db <= r["snr_db"] <= high_db
    ]


def over_bound(low_db, high_db):
    found = likelihood(20, low_db, high_db)
    errors = [r["std_good_standard_error_m_s"] / r["bound_m_s"] for r in found]
    return [words((mean([r["std_good_over_bound"] for r in found]), math.hypot(*errors) / len(errors)))]


def bad(pulses):
    found = likelihood(pulses, -10.0, -10.0)
    error = mean([r["bad_fraction_standard_error"] for r in found]) / math.sqrt(len(found))
    return [words((mean([r["bad_fraction"] for r in found]), error))]


def f16b():
    exact = ("growth of a wave in a step", "largest stable Courant number", "what the first step leaves of a stiff wave")
    points = [row for row in rows("fig16.maps") if row["panel"] in exact and row["theory"] > 1e-9]
    return [f"at most {100 * max(abs(row['measured'] / row['theory'] - 1) for row in points):.2f} %"]


def f19a():
    ratios = [r["gamma_m2_s"] / r["smallest_foretold_m2_s"] for r in rows("fig19") if r["standard_error"] != r["standard_error"]]
    return [f"{max(ratios, key=lambda ratio: abs(ratio - 1.0)):.3f}"]


def ap1():
    """Medians of draws over those of records, from the table: the errors of both as independent ones."""
    table = {(r["pulses_are"], r["pulses_per_line"]): (r["median_error_m_s"], r["standard_error_m_s"]) for r in rows("fig26")}
    found = []
    for (way, pulses), (records, error) in table.items():
        drawn = table.get(("drawn at once", pulses))
        if way == "record by record" and drawn:
            ratio = drawn[0] / records
            found.append(words((ratio, ratio * math.hypot(drawn[1] / drawn[0], error / records))))
    return found


def of_pairs(method):
    """Scans of a method in turbulence: errors and standard errors of their vortices, by level and dissipation rate."""
    cases = {}
    for row in rows("fig22"):
        if row["method"] == method and row["gamma_error_m2_s"] == row["gamma_error_m2_s"]:
            scans = cases.setdefault((row["snr_db"], row["dissipation_m2_s3"]), {})
            scans.setdefault(row["scan"], []).append((row["gamma_error_m2_s"], row["gamma_std_m2_s"]))
    return {case: list(scans.values()) for case, scans in cases.items()}


def rms_of_pairs(scans, number, without):
    squares = [vortex[number] ** 2 for i, scan in enumerate(scans) if i != without for vortex in scan]
    return math.sqrt(sum(squares) / len(squares))


def ct1():
    return [
        words(estimate(len(s), lambda b, s=s: rms_of_pairs(s, 1, b) / rms_of_pairs(s, 0, b)))
        for s in of_pairs("fit, turbulence of the scan").values()
    ]


def ct2():
    found = {}
    for row in rows("fig22"):
        if row["method"] == "detect":
            found.setdefault(row["snr_db"], []).append((row["detected_m2_s"], row["detected_error_m2_s"]))
    parts = []
    for (weak, weak_error), *_, (strong, strong_error) in found.values():
        ratio = strong / weak
        parts.append(words((ratio, ratio * math.hypot(weak_error / weak, strong_error / strong))))
    return parts


def of_scans(number):
    """A number of the scans of each dissipation rate, with its standard error from leaving out one scan at a time."""
    of_rate = {}
    for row in rows("fig23"):
        of_rate.setdefault(row["dissipation_m2_s3"], []).append(row)
    return [words(estimate(len(scans), lambda b, r=rate, s=scans: number(r, s, b))) for rate, scans in of_rate.items()]


def ka1():
    return of_scans(lambda rate, scans, b: mean([scan["eps23_m43_s2"] for scan in scans], b) / rate ** (2 / 3))


def ka2():
    return of_scans(lambda rate, scans, b: math.sqrt(mean([scan["reduced_square"] for scan in scans], b)))


CLAIMS = {
    "T1": t1, "F1b": f1b, "F4a": f4a, "F4b": f4b, "F4c": f4c, "F4d": f4d, "F6a": f6a, "F6b": f6b, "F7d": f7d, "F7e": f7e, "F8": f8,
    "F9b": f9b, "F10": f10, "F12a": f12a, "F12b": f12b, "F12c": f12c, "F13": f13, "F14a": f14a, "F14b": f14b,
    "F17a": lambda: of_maps("map, typical core"), "F17f": lambda: of_maps("map, core fitted"),
    "F17g": lambda: retrieved("analytic pair", "fit"), "F17h": lambda: retrieved("simulated wake, tau = 1", "fit"),
    "F17i": lambda: retrieved("simulated wake, tau = 2.5", "fit"), "F17j": lambda: retrieved("simulated wake, tau = 4", "fit"),
    "F18a": lambda: over_bound(0.0, 15.0), "F18b": lambda: over_bound(-5.0, 20.0), "F18c": lambda: bad(20), "F18d": lambda: bad(60),
    "F16b": f16b, "F19a": f19a,
    "CP1": cp1, "CP2": cp2, "CP3": cp3, "CP4": cp4, "CP5": cp5, "CP6": cp6, "AP1": ap1, "CT1": ct1, "CT2": ct2, "KA1": ka1, "KA2": ka2,
}  # fmt: skip
MEASURED = {row["id"]: row["measured"] for row in rows("claims")}


def is_in(value, measured):
    """Whether a value is part of what a claim measured; a claim of one number was read as that, without zeros at its end."""
    return float(value) == measured if isinstance(measured, float) else str(value) in str(measured)


def main():
    wrong = 0
    for claim, function in CLAIMS.items():
        if claim not in MEASURED:
            continue
        missing = [value for value in function() if not is_in(value, MEASURED[claim])]
        wrong += bool(missing)
        print(f"{claim:<5} {'differs: ' + '; '.join(missing) + ' is not in: ' + str(MEASURED[claim]) if missing else 'as computed'}")
    sys.exit(wrong > 0)


if __name__ == "__main__":
    main()
