"""Prints how long two runs of one thread each take in two Python threads, over their time one after the other; wants two idle cores.

python python/tests/two_runs.py [PAIRS]
"""

import statistics
import sys
import threading
import time

import wakescope

SCENES = [wakescope.scene(seed=seed, **{"outputs.svg": False, "outputs.png": False}) for seed in (1, 2)]


def one(scene):
    wakescope.run(scene, threads=1)


def in_turn():
    for scene in SCENES:
        one(scene)


def at_once():
    threads = [threading.Thread(target=one, args=(scene,)) for scene in SCENES]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()


def seconds(work):
    begun = time.perf_counter()
    work()
    return time.perf_counter() - begun


ratios = []
for _ in range(int(sys.argv[1]) if len(sys.argv) > 1 else 5):
    alone_s, together_s = seconds(in_turn), seconds(at_once)
    ratios.append(together_s / alone_s)
    print(f"one after the other {alone_s:.2f} s, at once {together_s:.2f} s, ratio {ratios[-1]:.3f}")
print(f"median ratio {statistics.median(ratios):.3f}")
