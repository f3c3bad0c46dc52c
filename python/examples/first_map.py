"""From a scene to a map that is plotted."""

import matplotlib.pyplot as plt

import wakescope

result = wakescope.run(wakescope.scene())
result.map.radial_velocity.plot()
plt.savefig("first_map.svg")
