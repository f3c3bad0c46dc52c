"""Posterior of y, z and circulation of each vortex given a scan: python posterior.py DATA_SET OUT"""
import sys
import time
from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optax
import posterior_data as data

SEED = 1
CHANNELS = (5, 16, 32, 32, 32)
STRIDES = (2, 2, 1, 1)
COMPONENTS = 4
BATCH = 32
PATIENCE = 10  # epochs without a lower loss of validation


class Network(eqx.Module):
    """Each Gaussian attends to cells of the scan: their mean position is its (y, z), their mean features give the rest."""

    convolutions: list
    attention: eqx.nn.Conv2d
    head: eqx.nn.Linear

    def __init__(self, key):
        keys = jax.random.split(key, len(CHANNELS) + 1)
        self.convolutions = [
            eqx.nn.Conv2d(CHANNELS[i], CHANNELS[i + 1], 3, STRIDES[i], padding=1, key=keys[i]) for i in range(len(STRIDES))
        ]
        self.attention = eqx.nn.Conv2d(CHANNELS[-1], 2 * COMPONENTS, 1, key=keys[-2])
        self.head = eqx.nn.Linear(CHANNELS[-1], 8, key=keys[-1])

    def __call__(self, scan):
        """The numbers [vortex, component, 8] of the mixture of a scan [channel, line, gate]."""
        positions = scan[-2:, ::4, ::4].reshape(2, -1)  # y and z of the cells that the strides leave
        for convolution in self.convolutions:
            scan = jax.nn.gelu(convolution(scan))
        attention = jax.nn.softmax(self.attention(scan).reshape(2 * COMPONENTS, -1))
        values = jax.vmap(self.head)(attention @ scan.reshape(len(scan), -1).T)
        values = values.at[:, 2:4].add(attention @ positions.T)
        return values.reshape(2, COMPONENTS, 8)


@eqx.filter_jit
def posterior(network, inputs):
    """The mixtures of scans with `inputs` [scan, channel, line, gate]."""
    values = jax.vmap(network)(inputs)
    log_weight = jax.nn.log_softmax(values[..., 1])
    return data.Mixture(values[..., 0].mean(-1), log_weight, values[..., 2:5], values[..., 5:])


@eqx.filter_jit
def loss(network, inputs, targets):
    """Mean of -log p(vortices | scan) over scans; `targets` [scan, vortex, 3] are scaled."""
    mixture = posterior(network, inputs)
    is_there = jnp.isfinite(targets[..., 0])
    known = jnp.where(is_there[..., None], targets, 0.0)
    errors = (known[:, :, None] - mixture.mean) * jnp.exp(-mixture.log_deviation)
    log_gaussian = -(0.5 * errors**2 + mixture.log_deviation).sum(-1)
    log_density = jax.nn.logsumexp(mixture.log_weight + log_gaussian, axis=-1)
    log_presence = jax.nn.log_sigmoid(jnp.where(is_there, mixture.presence, -mixture.presence))
    return -(log_presence + jnp.where(is_there, log_density, 0.0)).sum(-1).mean()


def train(scans, chosen, validation):
    """The network of the epoch with the lowest loss of validation, trained with the scans of the indices `chosen`."""
    network = Network(jax.random.key(SEED))
    optimizer = optax.adamw(3e-3, weight_decay=1e-2)
    state = optimizer.init(eqx.filter(network, eqx.is_array))

    @eqx.filter_jit
    def step(network, state, inputs, targets):
        gradients = eqx.filter_grad(loss)(network, inputs, targets)
        updates, state = optimizer.update(gradients, state, eqx.filter(network, eqx.is_array))
        return eqx.apply_updates(network, updates), state

    targets = data.scaled_targets(scans)
    random = np.random.default_rng(SEED)
    best_loss = np.inf
    epochs_since = 0
    while epochs_since < PATIENCE:
        order = random.permutation(chosen)
        for first in range(0, len(order) - BATCH + 1, BATCH):
            batch = order[first : first + BATCH]
            network, state = step(network, state, scans.inputs[batch], targets[batch])
        validation_loss = loss(network, validation.inputs, data.scaled_targets(validation))
        epochs_since += 1
        if validation_loss < best_loss:
            best = network
            best_loss = validation_loss
            epochs_since = 0
    return best


def main(folder, out):
    Path(out).mkdir(parents=True, exist_ok=True)
    print(f"jax {jax.__version__}, equinox {eqx.__version__}, optax {optax.__version__}, seed {SEED}")
    scans = data.read(folder, [data.TRAIN])
    validation = data.read(folder, [data.VALIDATION])
    print("training scans, time in s, error (rms) in validation of y in m, z in m, circulation in m2/s")
    flights = np.random.default_rng(SEED).permutation(np.unique(scans.flight))
    for fraction in (1 / 8, 1 / 4, 1 / 2, 1):
        start = time.time()
        chosen = np.flatnonzero(np.isin(scans.flight, flights[: round(fraction * len(flights))]))
        network = train(scans, chosen, validation)
        mean, _ = data.moments(posterior(network, validation.inputs), validation)
        rms = np.sqrt(np.nanmean((mean - validation.targets) ** 2, axis=(0, 1)))
        print(f"{len(chosen):5} {time.time() - start:5.0f}  {rms[0]:.1f} {rms[1]:.1f} {rms[2]:.1f}", flush=True)
    tests = data.read(folder, [data.TEST_HOME, data.TEST_AWAY])
    data.write_predictions(Path(out) / "predictions.csv", tests, posterior(network, tests.inputs))


if __name__ == "__main__":
    main(*sys.argv[1:])
