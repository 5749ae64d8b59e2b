"""Recurrent network of jax-sysid: linear state and output equations, each with a network of five neurons beside it.

``x(t + 1) = A x + B u + W3 s(W1 x + W2 u + b1) + b2`` and ``y = C x + W5 s(W4 x + b3) + b4``, s the sigmoid. Sizes,
spread of the random start, regularization and 2000 epochs of L-BFGS are those of jax-sysid's
example_parallel_training.py (nonlinear model), which trains from one start for each processor; here from one start.
The states are 2, 3 or 4. The initial state is fitted to the known samples by `learn_x0`, 10 passes as in
example_rnn.py. Reference: Bemporad, arXiv 2403.03827 (2024).
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import redirect_stdout
from io import StringIO

import jax
import jax.numpy as jnp
import numpy as np
from jax_sysid.models import Model

from benchmarks.peers.protocol import FreeRun, Peer, Run, Settings
from relaxations.algebra.arrays import Array

NEURONS = 5
SEED = 1
EPOCHS = 2000
PASSES = 10


def fit(runs: Sequence[Run], settings: Settings) -> FreeRun:
    """Train the network on all runs, each with an initial state of its own."""
    (states,) = settings
    n_inputs = runs[0].inputs.shape[1]
    model = Model(states, 1, n_inputs, state_fcn=_state, output_fcn=_output)
    model.init(params=_start(states, n_inputs))
    model.loss(rho_x0=1e-4, rho_th=1e-4)
    model.optimization(adam_epochs=0, lbfgs_epochs=EPOCHS, iprint=-1)
    with redirect_stdout(StringIO()):
        model.fit([run.output[:, None] for run in runs], [run.inputs for run in runs])

    def free_run(inputs: Array, known: Array) -> Array:
        start = model.learn_x0(inputs[: len(known)], known[:, None], RTS_epochs=PASSES, verbosity=False)
        return np.asarray(model.predict(start, inputs)[0]).ravel()

    return free_run


# jax-sysid calls both with its own name of the parameters, `params`.
def _state(x: jax.Array, u: jax.Array, params: list[jax.Array]) -> jax.Array:
    a, b, _, w1, w2, w3, b1, b2, *_ = params
    return a @ x + b @ u + w3 @ jax.nn.sigmoid(w1 @ x + w2 @ u + b1) + b2


def _output(x: jax.Array, u: jax.Array, params: list[jax.Array]) -> jax.Array:  # noqa: ARG001
    c, (w4, w5, b3, b4) = params[2], params[8:]
    return jnp.asarray(c @ x + w5 @ jax.nn.sigmoid(w4 @ x + b3) + b4)


def _start(states: int, n_inputs: int) -> list[Array]:
    rng = np.random.default_rng(SEED)
    a, b, c = 0.5 * np.eye(states), 0.1 * rng.normal(size=(states, n_inputs)), 0.1 * rng.normal(size=(1, states))
    w1, w2 = 0.1 * rng.normal(size=(NEURONS, states)), 0.5 * rng.normal(size=(NEURONS, n_inputs))
    w3, w4, w5 = (0.5 * rng.normal(size=shape) for shape in ((states, NEURONS), (NEURONS, states), (1, NEURONS)))
    return [a, b, c, w1, w2, w3, np.zeros(NEURONS), np.zeros(states), w4, w5, np.zeros(NEURONS), np.zeros(1)]


PEER = Peer("jax-sysid", ("states",), ((2,), (3,), (4,)), fit)
