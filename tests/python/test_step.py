"""`touchup step` against arithmetic of 50 digits and more.

The reference does not use the closed forms of the program. The position flow is one scalar equation, ds/dt = alpha (F.n - f(h0 - (a.n) s)).
Its right-hand side keeps its sign, so the time it takes to come to s is the integral of 1/rate, and bisection finds the s at which that
time is dt. In u = h/h_min + delta the integral is elementary; here it has plain exponentials and logarithms, and more digits make up for
cancellation (one test checks it by numerical quadrature). The impulse is J = F.n dt - s/alpha, the turned angle comes from angles.

The program comes from the environment variable TOUCHUP_BIN, or target/release/touchup.
"""

import json
import os
import random
import subprocess
from pathlib import Path

import mpmath as mp
import pytest

BIN = os.environ.get("TOUCHUP_BIN", str(Path(__file__).parents[2] / "target/release/touchup"))
EPS = mp.mpf(2) ** -52
RELATIVE = mp.mpf("1e-10")
CASES = int(os.environ.get("TOUCHUP_STEP_CASES", "300" if os.environ.get("TOUCHUP_FULL") else "40"))

mp.mp.dps = 50


def ask(questions):
    """One answer per question, from one run of the program; a question is an object or a line of text."""
    lines = "".join((q if isinstance(q, str) else json.dumps(q)) + "\n" for q in questions)
    run = subprocess.run([BIN, "step"], input=lines, capture_output=True, text=True, timeout=300, check=True)
    answers = [json.loads(line) for line in run.stdout.splitlines()]
    assert len(answers) == len(questions)
    return answers


def vec(a):
    return [mp.mpf(x) for x in a]


def plus(a, b, factor=1):
    return [x + factor * y for x, y in zip(a, b)]


def dot(a, b):
    return mp.fsum(x * y for x, y in zip(a, b))


def norm(a):
    return mp.sqrt(dot(a, a))


# --- reference -------------------------------------------------------------------------------------------------------


def share(u):
    return 1 / (1 + mp.exp(u))


def time_from_to(u0, u1, c):
    """Time that du/dT = 1/(1 + e^u) - c takes from u0 to u1."""
    if c == 0:
        return u1 + mp.exp(u1) - u0 - mp.exp(u0)
    if c == 1:
        return mp.exp(-u1) - u1 - mp.exp(-u0) + u0

    def antiderivative(u):
        return (u - mp.log(abs(1 - c - c * mp.exp(u))) / c) / (1 - c)

    return antiderivative(u1) - antiderivative(u0)


def change_of_u(u0, c, t):
    """u(t) - u(0), t of either sign, to about 45 digits."""
    digits = 70 + 2 * mp.log10(2 + abs(t)) + 2 * mp.log10(2 + abs(u0))
    if c in (0, 1):
        digits += min(abs(u0), 4000)
    else:
        digits += 2 * abs(mp.log10(abs(c))) + 2 * abs(mp.log10(abs(1 - c)))
    if 0 < c < 1:
        digits += min(abs(c * (1 - c) * t), 400) / 2
    with mp.workdps(int(digits)):
        rate = share(u0) - c
        if rate == 0 or t == 0:
            return mp.mpf(0)
        sign = mp.sign(rate) * mp.sign(t)
        rest = abs(mp.log((1 - c) / c) - u0) if 0 < c < 1 and t > 0 else mp.inf
        high = min(rest, abs(t) * max(abs(rate), abs(c), abs(1 - c)))

        def late(travel):
            return travel >= rest or abs(time_from_to(u0, u0 + sign * travel, c)) > abs(t)

        low = high
        while late(low):
            high, low = low, low / 4
        while high - low > high * mp.mpf(10) ** -45:
            middle = (low + high) / 2
            low, high = (low, middle) if late(middle) else (middle, high)
        return sign * (low + high) / 2


def position(q, h, force, kappa):
    """s and J of the position flow for h0, F.n and a.n."""
    alpha, dt = mp.mpf(q["alpha_m_per_n_s"]), mp.mpf(q["dt_s"])
    if "k_n_per_m" in q:
        k = mp.mpf(q["k_n_per_m"])
        s = (h + force / k) * (1 - mp.exp(-alpha * kappa * k * dt)) / kappa
    else:
        f_max, h_min = mp.mpf(q["f_max_n"]), mp.mpf(q["h_min_m"])
        scaled = alpha * kappa * f_max * dt / h_min
        s = -h_min * change_of_u(h / h_min + mp.mpf(q["delta"]), force / f_max, scaled) / kappa
    return s, force * dt - s / alpha


def along_of(q):
    force = vec(q["force_n"])
    if q["along"] == "normal0" or norm(force) == 0:
        return vec(q["n"])
    return [x / norm(force) for x in force]


def turned(q, j):
    """n after the impulse j, the angle it turned by, and how its end depends on its start and on j."""
    n, force = vec(q["n"]), vec(q["force_n"])
    n = [x / norm(n) for x in n]
    size = norm(force)
    if size == 0:
        return n, mp.mpf(0), mp.mpf(1), mp.mpf(0)
    tangent = plus(force, n, -dot(force, n))
    if norm(tangent) == 0:
        return n, mp.mpf(0), mp.mpf(1), mp.mpf(0)
    start = mp.atan2(norm(tangent), dot(force, n))
    rate = mp.mpf(q["beta_per_n2_s"]) * size
    end = 2 * mp.atan(mp.tan(start / 2) * mp.exp(-rate * j))
    angle = start - end
    tangent = [x / norm(tangent) for x in tangent]
    after = plus([mp.cos(angle) * x for x in n], tangent, mp.sin(angle))
    # d end / d start, and the axis, with an error of EPS / sin(start); d end / d j
    return after, angle, mp.sin(end) / mp.sin(start) + mp.sin(abs(angle)) / mp.sin(start), mp.sin(end) * rate


def expected(q):
    """Displacement and normal of a Lie step with the permitted error of each.

    The bound is 1e-10 of the displacement and of the angle, or the effect of the rounding of the inputs if that is more: h = (p - b).n
    comes from numbers of the size of |p - b| (four roundings) and meets delta in u (two), F.n comes from |F| (six), a.n from 1 (four). The
    test moves each by that much and evaluates the reference again. Turning adds three roundings of a unit vector, times the derivative of
    the end by the start (which grows near n = -F/|F|). Rounding the result takes the spacing of the coordinates of b, and s passes through
    four more products.
    """
    n, along = vec(q["n"]), along_of(q)
    arm = plus(vec(q["p_m"]), vec(q["b_m"]), -1)
    h, force, kappa = dot(arm, n), dot(vec(q["force_n"]), n), dot(along, n)
    s, j = position(q, h, force, kappa)
    scale = mp.mpf(q.get("delta", 0)) * mp.mpf(q.get("h_min_m", 0))
    moved = [
        position(q, h + EPS * (4 * norm(arm) + 2 * abs(scale)), force, kappa),
        position(q, h, force + 6 * EPS * norm(vec(q["force_n"])), kappa),
        position(q, h, force, kappa + 4 * EPS),
    ]
    s_error = mp.fsum(abs(other - s) for other, _ in moved)
    j_error = mp.fsum(abs(other - j) for _, other in moved)
    after, angle, from_start, from_j = turned(q, j)
    b_bound = max(RELATIVE * abs(s), s_error + 4 * EPS * abs(s)) + EPS * norm(vec(q["b_m"]))
    n_bound = max(RELATIVE * abs(angle), from_j * j_error) + 3 * EPS * (1 + from_start)
    return [s * x for x in along], b_bound, after, n_bound


# --- questions -------------------------------------------------------------------------------------------------------


def decades(rng, low, high):
    return 10.0 ** rng.uniform(low, high)


def direction(rng):
    v = [rng.gauss(0, 1) for _ in range(3)]
    length = sum(x * x for x in v) ** 0.5
    return [x / length for x in v]


def question(rng, tilted, reach=30.0):
    """h_min, f_max, alpha, beta and dt over 12 decades each; depth and force in the range of an effect."""
    n = direction(rng)
    h_min, f_max = decades(rng, -9, 3), decades(rng, -6, 6)
    delta = rng.choice([0.0, 5.0, rng.uniform(-20, 20)])
    share_of_f_max = rng.choice([rng.uniform(0, 1), rng.uniform(0, 1), decades(rng, -12, 0), 1 - decades(rng, -12, 0),
                                 decades(rng, 0, 3), 0.0, 1.0])
    towards = direction(rng) if tilted else n
    h = (rng.uniform(-reach, reach) - delta) * h_min
    b = [0.0, 0.0, 0.0] if rng.random() < 0.5 else [rng.uniform(-1, 1) * h_min for _ in range(3)]
    side = direction(rng)
    slip = rng.uniform(0, 1) * h_min
    p = [bi + h * ni + slip * (si - ni * sum(x * y for x, y in zip(side, n))) for bi, ni, si in zip(b, n, side)]
    return {
        "p_m": p, "force_n": [share_of_f_max * f_max * x for x in towards], "b_m": b, "n": n,
        "dt_s": decades(rng, -9, 3), "h_min_m": h_min, "delta": delta, "f_max_n": f_max,
        "alpha_m_per_n_s": decades(rng, -9, 3), "beta_per_n2_s": decades(rng, -9, 3),
        "step": "lie", "along": rng.choice(["normal0", "force"]),
    }


def scaled(q, span):
    """The same question with alpha such that T is of the size of `span` decades around 1."""
    q["alpha_m_per_n_s"] = span * q["h_min_m"] / (q["f_max_n"] * q["dt_s"])
    return q


def compare(questions):
    worst = {"b": (mp.mpf(0), None), "n": (mp.mpf(0), None)}
    for q, answer in zip(questions, ask(questions)):
        assert "error" not in answer, (answer, q)
        shift, b_bound, normal, n_bound = expected(q)
        b_error = norm(plus(plus(vec(answer["b_m"]), vec(q["b_m"]), -1), shift, -1))
        n_error = norm(plus(vec(answer["n"]), normal, -1))
        for key, ratio in (("b", b_error / b_bound), ("n", n_error / n_bound)):
            if ratio > worst[key][0]:
                worst[key] = (ratio, q)
        assert abs(norm(vec(answer["n"])) - 1) <= 2 * EPS
    print({key: mp.nstr(ratio, 3) for key, (ratio, _) in worst.items()})
    for key, (ratio, q) in worst.items():
        assert ratio <= 1, (key, mp.nstr(ratio, 5), json.dumps(q))


# --- tests -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("c", ["0", "1", "0.2", "-0.3", "1.7", "1e-9"])
def test_reference_time_is_the_integral_of_the_slowness(c):
    c = mp.mpf(c)
    by_quadrature = mp.quad(lambda u: 1 / (share(u) - c), mp.linspace(-3, mp.mpf("-1.5"), 5))
    assert abs(by_quadrature - time_from_to(mp.mpf(-3), mp.mpf("-1.5"), c)) < mp.mpf(10) ** -30


@pytest.mark.parametrize("tilted", [False, True], ids=["force along the normal", "tilted force"])
def test_lie_step_is_exact_over_twelve_decades(tilted):
    rng = random.Random(1 + tilted)
    compare([question(rng, tilted) for _ in range(CASES)])


@pytest.mark.parametrize("tilted", [False, True], ids=["force along the normal", "tilted force"])
def test_lie_step_is_exact_where_it_is_neither_short_nor_at_rest(tilted):
    rng = random.Random(3 + tilted)
    compare([scaled(question(rng, tilted), decades(rng, -3, 3)) for _ in range(CASES)])


def test_both_saturated_ends_are_left_and_entered():
    rng = random.Random(5)
    compare([scaled(question(rng, True, reach=600.0), decades(rng, 0, 3)) for _ in range(CASES // 2)])


def test_no_force_carves():
    rng = random.Random(6)
    questions = [scaled(question(rng, False, reach=60.0), decades(rng, -6, 6)) for _ in range(CASES // 4)]
    compare([q | {"force_n": [0.0, 0.0, 0.0]} for q in questions])


def test_turning_alone():
    """alpha so small that F* does not change, beta such that the face turns by anything from 1e-6 to half a turn."""
    rng = random.Random(7)
    questions = []
    for _ in range(CASES // 2):
        q = scaled(question(rng, True, reach=20.0), 1e-9)
        force = [1.0 * x for x in direction(rng)]
        if rng.random() < 0.3:
            tilt = decades(rng, -15, -1)
            force = [-x + tilt * y for x, y in zip(q["n"], force)]
        q |= {"force_n": force, "beta_per_n2_s": decades(rng, -6, 3) / (q["f_max_n"] * q["dt_s"])}
        questions.append(q)
    compare(questions)


def test_linear_spring_is_exact():
    rng = random.Random(8)
    questions = []
    for _ in range(CASES):
        q = scaled(question(rng, rng.random() < 0.5), 1.0)
        k = decades(rng, -3, 9)
        decay = decades(rng, -6, 2) if sum(x * y for x, y in zip(q["force_n"], q["n"])) >= 0 else decades(rng, -6, 0)
        q["alpha_m_per_n_s"] = decay / (k * q["dt_s"])
        size = decades(rng, -6, 3)
        h = sum((x - y) * z for x, y, z in zip(q["p_m"], q["b_m"], q["n"]))
        length = sum(x * x for x in q["force_n"]) ** 0.5
        if length > 0:
            q["force_n"] = [x / length * size * abs(k * h) for x in q["force_n"]]
        q["beta_per_n2_s"] = decades(rng, -6, 0) / max(1e-300, (k * abs(h)) ** 2 * size * max(1, size) * q["dt_s"])
        for name in ("h_min_m", "delta", "f_max_n"):
            del q[name]
        questions.append(q | {"k_n_per_m": k})
    compare(questions)


PLAIN = {
    "p_m": [0.0, 0.0, 0.0], "force_n": [0.4, 0.0, 2.0], "b_m": [0.0, 0.0, 1e-3], "n": [0.0, 0.0, 1.0], "dt_s": 0.002,
    "h_min_m": 5e-4, "delta": 5.0, "f_max_n": 10.0, "alpha_m_per_n_s": 0.1, "beta_per_n2_s": 0.1,
    "step": "lie", "along": "force",
}


def test_corrected_bounded_and_dp5_agree_with_an_integration_of_the_coupled_equations():
    """Taylor-series solution of the printed equations to 25 digits; the corrected step errs in third order."""
    q = PLAIN | {"beta_per_n2_s": 20.0}
    force, p, b0, n0 = (vec(q[k]) for k in ("force_n", "p_m", "b_m", "n"))
    along = [x / norm(force) for x in force]

    def rate(_, y):
        n = y[1:]
        h = dot(plus(plus(p, b0, -1), along, -y[0]), n)
        f = mp.mpf(10) * share(h / mp.mpf(q["h_min_m"]) + 5)
        pull = dot(force, n)
        turn = [mp.mpf(20) * f * (x - pull * z) for x, z in zip(force, n)]
        return [mp.mpf(q["alpha_m_per_n_s"]) * (pull - f), *turn]

    errors = {"dp5": [], "bounded": [], "corrected": [], "lie": []}
    for dt in (2e-3, 1e-3):
        with mp.workdps(25):
            y = mp.odefun(rate, 0, [mp.mpf(0), *n0])(mp.mpf(dt))
        for step, answer in zip(errors, ask([q | {"step": step, "dt_s": dt} for step in errors])):
            b_error = norm(plus(plus(vec(answer["b_m"]), b0, -1), along, -y[0])) / mp.mpf(q["h_min_m"])
            errors[step].append(float(b_error + norm(plus(vec(answer["n"]), y[1:], -1))))
    print(errors)
    assert max(errors["dp5"]) < 1e-9 and max(errors["bounded"]) < 1e-11
    assert errors["corrected"][0] < errors["lie"][0] / 5
    assert errors["corrected"][0] / errors["corrected"][1] > 6, "local error of third order"


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"weight": 1}, ["weight"]),
        ({"delta": None}, ["delta"]),
        ({"k_n_per_m": 900.0}, ["h_min_m", "k_n_per_m"]),
        ({"n": [0.0, 0.0, 0.5]}, ["normal", "0.5"]),
        ({"dt_s": -1.0}, ["time step", "-1"]),
        ({"h_min_m": 0.0}, ["h_min_m", "more than 0"]),
        ({"alpha_m_per_n_s": -0.1}, ["alpha_m_per_n_s"]),
        ({"step": "euler"}, ["euler", "corrected"]),
        ({"along": "z"}, ["normal0", "force"]),
        ({"step": "dp5", "alpha_m_per_n_s": 1e7}, ["stiff"]),
    ],
)
def test_a_bad_line_is_named_and_the_next_one_is_served(change, words):
    bad, good = ask([PLAIN | change, PLAIN])
    assert list(bad) == ["error"] and all(word in bad["error"] for word in words), bad
    assert set(good) == {"b_m", "n"}


def test_a_missing_key_and_broken_lines_are_named():
    without = {k: v for k, v in PLAIN.items() if k != "p_m"}
    answers = ask([without, "{", "[1, 2]", '{"p_m": NaN}', "x" * 100_000, PLAIN])
    assert "p_m" in answers[0]["error"] and "longer" in answers[4]["error"]
    assert all("error" in a for a in answers[:5]) and "b_m" in answers[5]


def test_each_answer_comes_before_the_next_question():
    with subprocess.Popen([BIN, "step"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as peer:
        for _ in range(3):
            peer.stdin.write(json.dumps(PLAIN) + "\n")
            peer.stdin.flush()
            assert "b_m" in json.loads(peer.stdout.readline())
        peer.stdin.close()
