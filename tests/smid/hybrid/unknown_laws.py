"""Plants with a law to be found, simulated by SciPy's integrators."""

import numpy as np
from scipy.integrate import solve_ivp

from smid.data import Dataset
from smid.hybrid import embedded
from smid.models import OwnModel, signal, t

AREA, OUTFLOW, HEAT, ROOM, FEED = 0.1, 4e-5, 4.18e6, 18.0, 15.0
STEP = 30.0
LAWS = {
    "power_law": lambda x: 55.0 * np.abs(x) ** 1.25,
    "proportional + quadratic_drag": lambda x: 120.0 * x + 1.2 * x * np.abs(x),
    "square_root_outflow": lambda x: 1500.0 * np.sqrt(np.abs(x)),
    "exponential": lambda x: 900.0 * np.exp(x / 28.0),
}
BALANCES = ("d/dt h = (inflow - k*sqrt(h)) / 0.1", "d/dt T = (power + 4.18e6*inflow*(15 - T)) / (4.18e6*0.1*h)")
SHOWN = {"level": "h", "temp": "T"}


def tank_record(loss, seed, n=400, noise=(1e-3, 0.05), outputs=("level", "temp")):
    """Return level and temperature of a heated tank whose heat loss in W is a function of T - 18 degC."""
    rng = np.random.default_rng(seed)
    inflow = np.repeat(rng.uniform(1.5e-5, 2.8e-5, n // 20), 20)
    power = np.repeat(rng.choice([3e3, 5e3, 8e3, 11e3, 14e3], n // 40), 40)

    def rates(_, state, k):
        level, temp = state
        heat = power[k] + HEAT * inflow[k] * (FEED - temp) - loss(temp - ROOM)
        return (inflow[k] - OUTFLOW * np.sqrt(level)) / AREA, heat / (HEAT * AREA * level)

    states = [[0.3, 28.0]]
    for k in range(n - 1):
        states.append(solve_ivp(rates, (0, STEP), states[-1], args=(k,), rtol=1e-8).y[:, -1])
    seen = dict(zip(SHOWN, np.transpose(states), strict=True))
    noisy = {name: seen[name] + size * rng.standard_normal(n) for name, size in zip(SHOWN, noise, strict=True)}
    return Dataset.from_arrays(
        input={"inflow": inflow, "power": power}, output={name: noisy[name] for name in outputs}, sampling_time=STEP
    )


def tank_model(outputs=("level", "temp"), hidden=(3,), **options):
    """Return the tank with a network in the place of the heat loss."""
    white = OwnModel(list(BALANCES), {name: SHOWN[name] for name in outputs}, ["inflow", "power"], {"k": (1e-5, 1e-4)})
    h, temp = signal("h")[t], signal("T")[t]
    return embedded(white, {"T": -1 / (HEAT * AREA * h)}, [temp - ROOM], hidden, **options)


def slide_record(friction, seed, n=400, step=0.02, noise=1e-3):
    """Return the position of a mass of 1 kg on a spring of 2 N/m, under a stepwise force and friction."""
    rng = np.random.default_rng(seed)
    force = np.repeat(rng.uniform(-4.0, 4.0, n // 25), 25)

    def rates(_, state, k):
        return state[1], force[k] - 2.0 * state[0] - friction(state[1])

    states = [[0.0, 0.0]]
    for k in range(n - 1):
        found = solve_ivp(rates, (0, step), states[-1], args=(k,), method="LSODA", rtol=1e-7, atol=1e-9)
        states.append(found.y[:, -1])
    position = np.array(states)[:, 0] + noise * rng.standard_normal(n)
    return Dataset.from_arrays(input={"force": force}, output={"position": position}, sampling_time=step)
