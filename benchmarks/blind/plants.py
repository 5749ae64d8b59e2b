"""Base plants of the blind cases and their simulation on a grid ``SUBSTEPS`` times finer than the sampling.

Each plant is a static curve (clutch only) and linear dynamics, from an input that is held between samples:

    clutch       tau w' = curve(u) - w              clutch thesis, section 3.2; numbers of data/README.md
    cstr         tau w' = (1 - 0.12 tau) u - w      hybrid thesis, eq. 5.6
    arm_speed    w' = theta (c u - d w)             hybrid thesis, eq. 5.9 and Newton's law, plus a viscous term d
    arm_angle    a' = w, w as above                 measured: the angle a
    arm_free     w' = theta c u                     the speed, without any friction
    linear1      tau w' = K u - w                   random
    linear2      w'' + 2 zeta omega w' = omega^2 (K u - w)

`Twist` collects what the effects change. Where nothing nonlinear acts on the state the fine grid is walked by its exact
discretisation, otherwise by the midpoint rule; stick and slip are told apart event by event.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from math import exp

import numpy as np
from scipy.linalg import expm
from scipy.signal import lfilter

from relaxations.algebra.arrays import Array

__all__ = ["SUBSTEPS", "Coupling", "Friction", "Plant", "Twist", "draw_plant", "simulate"]

Map = Callable[[Array], Array]
SUBSTEPS = 20
THETA, TORQUE = 21.7391, 15.96  # reciprocal inertia and torque per volt, hybrid thesis, eq. 5.9
REACTION = 0.12  # reaction rate in 1/s, hybrid thesis, section 5.2
CLUTCH_POLE, GAMMAS = 0.65142, (-0.00272, 0.03903, -0.08172)


@dataclass(frozen=True)
class Plant:
    """A base plant with numbers.

    Attributes
    ----------
    name : str
        Which of the plants of the module's head.
    sampling_time : float
        In seconds.
    low, high : float
        Range of the input, in its unit.
    input, output : str
        Channels.
    gain : float
        Static gain; for ``arm_free`` the acceleration per volt.
    tau : float
        Time constant in seconds; for ``linear2`` ``1 / omega``.
    damping : float
        zeta of ``linear2``.
    """

    name: str
    sampling_time: float
    low: float
    high: float
    input: str
    output: str
    gain: float
    tau: float
    damping: float = 1.0

    @property
    def order(self) -> int:
        """Number of states."""
        return 2 if self.name in ("linear2", "arm_angle") else 1

    @property
    def tempo(self) -> float:
        """Slowest time constant in samples."""
        if self.name == "arm_free":
            return 8.0
        slowest = self.tau * (self.damping + np.sqrt(max(0.0, self.damping**2 - 1.0))) if self.order == 2 else self.tau
        return float(max(self.tau, slowest) / self.sampling_time)

    @property
    def balanced(self) -> bool:
        """Whether the plant integrates, so that the mean of its input must vanish."""
        return self.name in ("arm_angle", "arm_free")

    def features(self, u: Array) -> Array:
        """Columns that the base model weighs freely and feeds to its linear part, shape (n, 1 or 3)."""
        v = 0.01 * u
        return np.stack([v**5, v**4, v**3], axis=1) if self.name == "clutch" else u[:, None]


@dataclass(frozen=True)
class Friction:
    """Forces against motion, each already multiplied by the reciprocal inertia.

    Attributes
    ----------
    sliding, breakaway : float
        Constant friction when sliding at speed, and what must be overcome from rest; in units of acceleration.
    fading : float
        Speed over which breakaway fades to sliding; 0: no difference.
    viscous, drag : float
        Factors of ``w`` and ``w |w|``.
    load : numpy.ndarray or None
        Factor of sliding and breakaway on the fine grid.
    """

    sliding: float = 0.0
    breakaway: float = 0.0
    fading: float = 0.0
    viscous: float = 0.0
    drag: float = 0.0
    load: Array | None = None


@dataclass(frozen=True)
class Coupling:
    """A second mass behind a spring and a damper, which touch after a gap and never pull.

    Attributes
    ----------
    share : float
        Part of the inertia that the second mass has.
    omega, damping : float
        Angular frequency in rad/s and damping ratio of the second mass against a fixed first one.
    gap : float
        Play, in units of the twist.
    at_second : bool
        Whether the sensor is at the second mass.
    """

    share: float
    omega: float
    damping: float
    gap: float = 0.0
    at_second: bool = False


@dataclass(frozen=True)
class Twist:
    """What effects change in a plant; the default changes nothing.

    Attributes
    ----------
    input, drive : tuple of callables
        Maps of the held input, and of what drives the linear part, on the fine grid, shape (n SUBSTEPS,).
    gain, slow : numpy.ndarray or None
        Factors of the gain and of the time constant on the fine grid.
    gain_of, slow_of : callable or None
        Factor of the gain by the state, and of the time constant by state, drive and rate.
    power : float
        The state decays as ``w^power``.
    friction : Friction or None
        Arm only.
    push : callable or None
        What is added to the rate of the last state, by first state and drive: an acceleration where there are two
        states.
    coupling : Coupling or None
        Arm only.
    sensor : tuple of callables
        Maps of the output on the fine grid: sensors with a memory.
    output : tuple of callables
        Maps of the sampled output, shape (n,).
    seen_twice : bool
        Whether a second sensor records the output, without sensor effects.
    channels : Mapping of str to numpy.ndarray
        Further measured channels.
    input_error : numpy.ndarray or None
        Recorded minus true input.
    glitches : float
        Share of samples that are outliers.
    growing : float
        Noise at the largest magnitude of the output over that at zero; 0: constant noise.
    quantised : bool
        Whether the recorded output is rounded.
    """

    input: tuple[Map, ...] = ()
    drive: tuple[Map, ...] = ()
    gain: Array | None = None
    slow: Array | None = None
    gain_of: Callable[[float], float] | None = None
    slow_of: Callable[[float, float, float], float] | None = None
    power: float = 1.0
    friction: Friction | None = None
    push: Callable[[float, float], float] | None = None
    coupling: Coupling | None = None
    sensor: tuple[Map, ...] = ()
    output: tuple[Map, ...] = ()
    seen_twice: bool = False
    channels: Mapping[str, Array] = field(default_factory=dict)
    input_error: Array | None = None
    glitches: float = 0.0
    growing: float = 0.0
    quantised: bool = False

    @property
    def is_linear(self) -> bool:
        """Whether the dynamics stay linear and constant, the gain apart."""
        changed = self.gain_of or self.slow_of or self.friction or self.push or self.coupling
        return self.slow is None and not changed and self.power == 1.0


def draw_plant(rng: np.random.Generator, name: str, needs: str = "") -> Plant:
    """Draw the numbers of a plant.

    Parameters
    ----------
    rng : numpy.random.Generator
        Source of every choice.
    name : str
        Which plant.
    needs : {"", "positive", "signed"}
        What the effect asks of the input: anything, one sign, or both signs.

    Returns
    -------
    Plant
        With random numbers.

    Examples
    --------
    >>> draw_plant(np.random.default_rng(0), "clutch").sampling_time
    0.002
    """
    if name == "clutch":
        return Plant(name, 2e-3, 0.0, 900.0, "current", "pressure", 1.0, -2e-3 / np.log(CLUTCH_POLE))
    if name == "cstr":
        tau = rng.uniform(1.2, 3.5)
        low, high = rng.uniform(0.1, 0.5), rng.uniform(1.2, 2.5)
        return Plant(
            name, float(rng.choice([0.2, 0.25, 0.4])), low, high, "feed", "concentration", 1 - REACTION * tau, tau
        )
    if name.startswith("arm"):
        period, volts, viscous = float(rng.choice([0.01, 0.02])), rng.uniform(0.1, 0.5), rng.uniform(0.2, 0.8)
        if name == "arm_free":
            return Plant(name, period, -volts, volts, "voltage", "speed", THETA * TORQUE, 1.0)
        output = "angle" if name == "arm_angle" else "speed"
        return Plant(name, period, -volts, volts, "voltage", output, TORQUE / viscous, 1 / (THETA * viscous))
    period = float(rng.choice([0.01, 0.1, 1.0]))
    size = float(np.exp(rng.uniform(np.log(0.5), np.log(20.0))))
    form = needs or rng.choice(["positive", "signed", "signed"])
    low = size * rng.uniform(0.1, 0.25) if form == "positive" else -size * rng.uniform(0.6, 1.0)
    gain = float(np.exp(rng.uniform(np.log(0.3), np.log(5.0))) * (1.0 if needs == "positive" else rng.choice([-1, 1])))
    tau = period * float(np.exp(rng.uniform(np.log(3.0), np.log(30.0))))
    if name == "linear1":
        return Plant(name, period, low, size, "u", "y", gain, tau)
    # Of two poles the slower one sets the tempo, so the pair is drawn somewhat faster.
    damping = rng.uniform(0.5, 1.6)
    return Plant(name, period, low, size, "u", "y", gain, max(3.0 * period, tau / 2), damping)


def simulate(plant: Plant, twist: Twist, u: Array, start: float = 0.0) -> Array:
    """Simulate the noise-free output.

    Parameters
    ----------
    plant : Plant
        The base plant.
    twist : Twist
        Its changes.
    u : numpy.ndarray, shape (n,)
        The true input, held over each sampling interval.
    start : float
        First state at time zero; everything else is at rest.

    Returns
    -------
    numpy.ndarray, shape (n,)
        The output at the sampling instants, sensor included, without noise.

    Examples
    --------
    >>> plant = Plant("linear1", 1.0, -1, 1, "u", "y", 2.0, 10.0)
    >>> simulate(plant, Twist(), np.ones(200))[-1].round(6)
    np.float64(2.0)
    """
    fine = np.repeat(u, SUBSTEPS)
    for change in twist.input:
        fine = change(fine)
    if plant.name == "clutch":
        v = 0.01 * fine
        fine = GAMMAS[0] * v**5 + GAMMAS[1] * v**4 + GAMMAS[2] * v**3
    for change in twist.drive:
        fine = change(fine)
    if twist.gain is not None:
        fine = fine * twist.gain
    w = _exact(plant, fine, start) if twist.is_linear else _walk(plant, twist, fine, start)
    for change in twist.sensor:
        w = change(w)
    y = w[::SUBSTEPS][: len(u)]
    for change in twist.output:
        y = change(y)
    return y


def _exact(plant: Plant, fine: Array, start: float) -> Array:
    """Walk the fine grid by the exact discretisation of the constant linear part."""
    h = plant.sampling_time / SUBSTEPS
    past = np.concatenate([[0.0], fine[:-1]])
    if plant.name == "arm_free":
        return np.asarray(start + plant.gain * h * np.cumsum(past))
    if plant.order == 1:
        pole = np.exp(-h / plant.tau)
        past = plant.gain * (1 - pole) * past
        past[0] = start
        return np.asarray(lfilter([1.0], [1.0, -pole], past))
    if plant.name == "arm_angle":
        a, b = np.array([[0.0, 1.0], [0.0, -1 / plant.tau]]), np.array([0.0, plant.gain / plant.tau])
    else:
        square = plant.tau**-2
        a = np.array([[0.0, 1.0], [-square, -2 * plant.damping / plant.tau]])
        b = np.array([0.0, plant.gain * square])
    block = expm(np.block([[a, b[:, None]], [np.zeros((1, 3))]]) * h)
    phi, gamma = block[:2, :2], block[:2, 2]
    denominator = [1.0, -np.trace(phi), np.linalg.det(phi)]
    numerator = [0.0, gamma[0], phi[0, 1] * gamma[1] - phi[1, 1] * gamma[0]]
    # The free response from (start, 0) has the same denominator.
    impulse = np.zeros_like(fine)
    impulse[0] = start
    free = lfilter([1.0, -phi[1, 1]], denominator, impulse)
    return np.asarray(lfilter(numerator, denominator, fine) + free)


def _walk(plant: Plant, twist: Twist, fine: Array, start: float) -> Array:
    if twist.coupling is not None:
        initial = 0.0 if plant.name == "arm_angle" else start
        speed = _two_masses(plant, twist.coupling, fine, initial)
        if plant.name == "arm_angle":
            return np.asarray(start + _running_integral(speed, plant.sampling_time / SUBSTEPS))
        return speed
    if twist.friction is not None:
        initial = 0.0 if plant.name == "arm_angle" else start
        speed = _stick_slip(plant, twist, twist.friction, fine, initial, start)
        if plant.name == "arm_angle":
            return np.asarray(start + _running_integral(speed, plant.sampling_time / SUBSTEPS))
        return speed
    if plant.name == "linear2" or (plant.name == "arm_angle" and twist.push is not None):
        return _walk_second(plant, twist, fine, start)
    if plant.name == "arm_angle":
        speed = _walk_first(plant, twist, fine, 0.0)
        return np.asarray(start + _running_integral(speed, plant.sampling_time / SUBSTEPS))
    return _walk_first(plant, twist, fine, start)


def _running_integral(speed: Array, h: float) -> Array:
    return np.concatenate([[0.0], np.cumsum(0.5 * h * (speed[1:] + speed[:-1]))])


def _rates(plant: Plant) -> tuple[float, float]:
    """Return the factors of drive and state in the rate of a first order plant."""
    return (plant.gain, 0.0) if plant.name == "arm_free" else (plant.gain / plant.tau, 1 / plant.tau)


def _walk_first(plant: Plant, twist: Twist, fine: Array, start: float) -> Array:
    h = plant.sampling_time / SUBSTEPS
    push, decay = _rates(plant)
    power, gain_of, slow_of, pushed = twist.power, twist.gain_of, twist.slow_of, twist.push
    slow = None if twist.slow is None else twist.slow.tolist()

    def rate(x: float, drive: float, factor: float) -> float:
        left = x if power == 1.0 else (abs(x) ** power if x >= 0 else -(abs(x) ** power))
        r = push * drive * (1.0 if gain_of is None else gain_of(x)) - decay * left
        if pushed is not None:
            r += pushed(x, drive)
        return r / (factor if slow_of is None else factor * slow_of(x, drive, r))

    out, x = [], start
    for j, drive in enumerate(fine.tolist()):
        out.append(x)
        factor = 1.0 if slow is None else slow[j]
        x += h * rate(x + 0.5 * h * rate(x, drive, factor), drive, factor)
    return np.array(out)


def _walk_second(plant: Plant, twist: Twist, fine: Array, start: float) -> Array:
    h, square, twice = plant.sampling_time / SUBSTEPS, plant.tau**-2, 2 * plant.damping / plant.tau
    free = plant.name == "arm_angle"  # no spring
    push, decay = _rates(plant)
    gain_of, slow_of, pushed = twist.gain_of, twist.slow_of, twist.push
    slow = None if twist.slow is None else twist.slow.tolist()

    def acceleration(x: float, v: float, drive: float, target: float) -> float:
        a = push * drive - decay * v if free else square * (target - x) - twice * v
        return a if pushed is None else a + pushed(x, drive)

    out, x, v = [], start, 0.0
    for j, drive in enumerate(fine.tolist()):
        out.append(x)
        factor = 1.0 if slow is None else slow[j]
        if slow_of is not None:
            factor *= slow_of(x, drive, v)
        target = plant.gain * drive * (1.0 if gain_of is None else gain_of(x))
        # The factor stretches time; v is the velocity in stretched time.
        step = h / factor
        middle_x, middle_v = x + 0.5 * step * v, v + 0.5 * step * acceleration(x, v, drive, target)
        x, v = x + step * middle_v, v + step * acceleration(middle_x, middle_v, drive, target)
    return np.array(out)


def _stick_slip(plant: Plant, twist: Twist, friction: Friction, fine: Array, start: float, angle: float) -> Array:
    """Walk the speed; it sticks where it would change its sign while the drive is below the breakaway force."""
    slow, pushed = twist.slow, twist.push
    h = plant.sampling_time / SUBSTEPS
    push, decay = _rates(plant)
    decay += friction.viscous
    drag, sliding, fading = friction.drag, friction.sliding, friction.fading
    extra = friction.breakaway - friction.sliding if fading else 0.0
    factors = None if slow is None else slow.tolist()
    load = None if friction.load is None else friction.load.tolist()

    def level(speed: float) -> float:
        return sliding + extra * exp(-abs(speed) / fading) if extra else sliding

    def against(speed: float) -> float:
        return decay * speed + drag * speed * abs(speed)

    sticks = friction.breakaway > 0
    out, speed, direction = [], start, int(np.sign(start))
    for j, drive in enumerate(fine.tolist()):
        out.append(speed)
        first = angle if plant.order == 2 else speed
        applied = push * drive + (0.0 if pushed is None else pushed(first, drive))
        step = h if factors is None else h / factors[j]
        pressed = 1.0 if load is None else load[j]
        if sticks and direction == 0:
            if abs(applied) <= pressed * friction.breakaway:
                continue
            direction = 1 if applied > 0 else -1
        half = speed + 0.5 * step * (applied - against(speed) - direction * pressed * level(speed))
        if sticks and half * direction < 0:
            half = 0.0
        speed = speed + step * (applied - against(half) - direction * pressed * level(half))
        angle += step * half
        if sticks and speed * direction <= 0:
            speed, direction = 0.0, 0
    return np.array(out)


def _two_masses(plant: Plant, coupling: Coupling, fine: Array, start: float) -> Array:
    """Walk two masses by the midpoint rule; the drive and the viscous friction act on the first."""
    h = plant.sampling_time / SUBSTEPS
    push, decay = _rates(plant)
    square, twice = coupling.omega**2, 2 * coupling.damping * coupling.omega

    def rates(first: float, second: float, twist: float, drive: float) -> tuple[float, float, float]:
        beyond = twist - max(-coupling.gap / 2, min(coupling.gap / 2, twist))
        force = 0.0
        if beyond or not coupling.gap:
            force = square * beyond + twice * (first - second)
            # Behind a gap a wall pushes and does not pull.
            force = force if force * beyond > 0 or not coupling.gap else 0.0
        return (push * drive - decay * first - coupling.share * force) / (1 - coupling.share), force, first - second

    out, first, second, twist = [], start, start, 0.0
    for drive in fine.tolist():
        out.append(second if coupling.at_second else first)
        a, b, c = rates(first, second, twist, drive)
        a, b, c = rates(first + 0.5 * h * a, second + 0.5 * h * b, twist + 0.5 * h * c, drive)
        first, second, twist = first + h * a, second + h * b, twist + h * c
    return np.array(out)
