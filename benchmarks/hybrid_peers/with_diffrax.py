"""diffrax, equinox and optimistix (JAX): Kvaerno's implicit scheme, Levenberg-Marquardt with forward derivatives."""

import diffrax
import equinox
import jax
import jax.numpy as jnp
import optimistix

jax.config.update("jax_enable_x64", True)


def weights(network):
    first, last = network.layers
    return first.weight, first.bias, last.weight, last.bias


class Arm(equinox.Module):  # noqa: D101
    theta: jax.Array
    network: equinox.nn.MLP

    def __init__(self, start):
        self.theta = jnp.asarray(start[0])
        mlp = equinox.nn.MLP(1, 1, 5, 1, jnp.tanh, key=jax.random.key(0))
        parts = (start[1:6, None], start[6:11], start[None, 11:16], start[16:])
        self.network = equinox.tree_at(weights, mlp, tuple(map(jnp.asarray, parts)))

    def rate(self, _time, state, voltage):  # noqa: D102
        friction = 16 * self.network(state[1:] / 80)[0]
        return jnp.array([state[1], 16 * self.theta * (15.96 * voltage - friction)])


def run(arm, u, h):
    def held(state, voltage):
        solution = diffrax.diffeqsolve(
            diffrax.ODETerm(arm.rate),
            diffrax.Kvaerno3(),
            0.0,
            h,
            h,
            state,
            voltage,
            stepsize_controller=diffrax.PIDController(rtol=1e-5, atol=1e-7),
            adjoint=diffrax.ForwardMode(),
            throw=False,
        )
        return solution.ys[0], state[0]

    return jax.lax.scan(held, jnp.zeros(2), u)[1]


def train(u, y, h, start):
    moving, fixed = equinox.partition(Arm(start), equinox.is_array)
    found = optimistix.least_squares(
        lambda arm, _: run(equinox.combine(arm, fixed), u, h) - y,
        optimistix.LevenbergMarquardt(rtol=1e-10, atol=1e-12),
        moving,
        options={"jac": "fwd"},
        max_steps=100,
        throw=False,
    )
    arm = equinox.combine(found.value, fixed)
    return 16 * float(arm.theta), lambda u: run(arm, u, h)
