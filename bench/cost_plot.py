# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
"""Cost against time as an SVG: relative gap to f* over seconds, both axes logarithmic."""
import math
from xml.sax.saxutils import escape

# Okabe and Ito's palette, told apart with any kind of colour vision; marks differ as well.
COLOURS = ("#000000", "#D55E00", "#0072B2", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
MARKS = ("circle", "square", "diamond", "triangle", "cross", "down", "plus")
WIDTH, HEIGHT = 960, 440
LEFT, RIGHT, TOP, BOTTOM = 78, 330, 40, 52
FLOOR = 1e-8  # gaps below are drawn here: they are rounding and the end of convergence


class Axis:
    """Decades of [low, high] onto pixels [start, end]."""

    def __init__(self, low, high, start, end):
        self.low, self.high = math.log10(low), math.log10(high)
        self.start, self.end = start, end

    def __call__(self, value):
        share = (math.log10(value) - self.low) / (self.high - self.low)
        return self.start + share * (self.end - self.start)

    def ticks(self, most=9):
        """Powers of ten; 1, 2, 5 of each where that leaves few."""
        first, last = math.ceil(self.low - 1e-9), math.floor(self.high + 1e-9)
        if last - first >= 3:
            stride = math.ceil((last - first + 1) / most)
            return [10.0 ** e for e in range(first, last + 1, stride)]
        values = [m * 10.0 ** e for e in range(first - 1, last + 1) for m in (1, 2, 5)]
        return [v for v in values if self.low <= math.log10(v) <= self.high]


class LinearAxis:
    """[0, high] onto pixels [start, end]."""

    def __init__(self, high, start, end):
        self.high, self.start, self.end = high, start, end

    def __call__(self, value):
        return self.start + value / self.high * (self.end - self.start)

    def ticks(self):
        return [self.high * i / 5 for i in range(6)]


def gaps(trace, optimum):
    return [(t, max(c / optimum - 1, FLOOR)) for t, c in trace if t > 0 and math.isfinite(c)]


def until_floor(points):
    """What comes after the floor is reached says nothing more."""
    for i, (_, gap) in enumerate(points):
        if gap <= FLOOR:
            return points[:i + 1]
    return points


def mark(kind, x, y, colour):
    s = 3.6
    shapes = {"square": f"M{x - s},{y - s}h{2 * s}v{2 * s}h{-2 * s}z",
              "diamond": f"M{x},{y - 1.3 * s}l{1.3 * s},{1.3 * s}l{-1.3 * s},{1.3 * s}"
                         f"l{-1.3 * s},{-1.3 * s}z",
              "triangle": f"M{x},{y - 1.2 * s}l{1.2 * s},{2.1 * s}h{-2.4 * s}z",
              "down": f"M{x},{y + 1.2 * s}l{1.2 * s},{-2.1 * s}h{-2.4 * s}z"}
    if kind == "circle":
        return f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{s}" fill="{colour}"/>'
    if kind in shapes:
        return f'<path d="{shapes[kind]}" fill="{colour}"/>'
    lines = {"cross": f"M{x - s},{y - s}l{2 * s},{2 * s}M{x - s},{y + s}l{2 * s},{-2 * s}",
             "plus": f"M{x - s},{y}h{2 * s}M{x},{y - s}v{2 * s}"}
    return f'<path d="{lines[kind]}" stroke="{colour}" stroke-width="2" fill="none"/>'


def tick_text(value):
    if value == 0 or 1e-3 <= value <= 1e3:
        return f"{value:g}"
    exponent = math.floor(math.log10(value) + 1e-9)
    digit = round(value / 10.0 ** exponent)
    return (f"{digit}·" if digit > 1 else "") + f'10<tspan dy="-5" font-size="9">{exponent}</tspan>'


def grid(x, y):
    parts = []
    for value in x.ticks():
        at = x(value)
        parts.append(f'<path d="M{at:.1f},{TOP}V{HEIGHT - BOTTOM}" stroke="#ddd"/>'
                     f'<text x="{at:.1f}" y="{HEIGHT - BOTTOM + 18}" text-anchor="middle">'
                     f"{tick_text(value)}</text>")
    for value in y.ticks():
        at = y(value)
        parts.append(f'<path d="M{LEFT},{at:.1f}H{WIDTH - RIGHT}" stroke="#ddd"/>'
                     f'<text x="{LEFT - 8}" y="{at + 4:.1f}" text-anchor="end">'
                     f"{tick_text(value)}</text>")
    return parts


def thinned(places, most=200, apart=4):
    """Of a curve of very many points, the ends and those that are some pixels apart."""
    if len(places) <= most:
        return places
    kept = [places[0]]
    for at in places[1:-1]:
        if math.hypot(at[0] - kept[-1][0], at[1] - kept[-1][1]) >= apart:
            kept.append(at)
    return kept + [places[-1]]


def chart(title, x, y, names, curves):
    """The frame and its curves: `x` and `y` axes, `names` of the two, `curves` a list of (label,
    places in pixels). The first is drawn last, on top. Returns the SVG text."""
    out = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" '
           f'width="{WIDTH}" height="{HEIGHT}" font-family="sans-serif" font-size="12" '
           f'fill="#222"><rect width="100%" height="100%" fill="#fff"/>',
           f'<text x="{LEFT}" y="24" font-size="15">{escape(title)}</text>']
    out += grid(x, y)
    out.append(f'<text x="{(LEFT + WIDTH - RIGHT) / 2}" y="{HEIGHT - 12}" text-anchor="middle">'
               f"{escape(names[0])}</text>")
    out.append(f'<text transform="translate(18,{(TOP + HEIGHT - BOTTOM) / 2}) rotate(-90)" '
               f'text-anchor="middle">{escape(names[1])}</text>')
    for i, (label, places) in reversed(list(enumerate(curves))):
        colour, kind = COLOURS[i % len(COLOURS)], MARKS[i % len(MARKS)]
        places = thinned(places)
        path = "L".join(f"{a:.1f},{b:.1f}" for a, b in places)
        out.append(f'<path d="M{path}" fill="none" stroke="{colour}" '
                   f'stroke-width="{2.5 if i == 0 else 1.6}"/>')
        out += [mark(kind, round(a, 1), round(b, 1), colour) for a, b in places]
        at = TOP + 14 + 24 * i
        out.append(f'<path d="M{WIDTH - RIGHT + 14},{at - 4}h22" stroke="{colour}" '
                   f'stroke-width="2"/>' + mark(kind, WIDTH - RIGHT + 25, at - 4, colour) +
                   f'<text x="{WIDTH - RIGHT + 44}" y="{at}">{escape(label)}</text>')
    out.append("</svg>")
    return "\n".join(out) + "\n"


def draw(title, curves, optimum):
    """`curves`: list of (label, trace). Returns the SVG text."""
    drawn = [(label, until_floor(gaps(trace, optimum))) for label, trace in curves]
    drawn = [(label, points) for label, points in drawn if points]
    times = [t for _, points in drawn for t, _ in points]
    highest = max(gap for _, points in drawn for _, gap in points)
    x = Axis(min(times) / 1.15, max(times) * 1.15, LEFT, WIDTH - RIGHT)
    y = Axis(FLOOR / 1.5, highest * 1.6, HEIGHT - BOTTOM, TOP)
    return chart(title, x, y, ("seconds, set-up included", "cost / best cost − 1"),
                 [(label, [(x(t), y(gap)) for t, gap in points]) for label, points in drawn])
