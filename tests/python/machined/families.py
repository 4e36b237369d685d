"""Families of random machined parts: blocks, plates, castings, shafts, brackets, sheets.

Each draws its sizes, places features without crossings unless it intends one, and notes the true features.
"""

import numpy as np
from manifold3d import CrossSection, JoinType, Manifold

from .part import Feature, Part, circle, cone, frame, rod, rounded, segments

# tools reach this far out of the surface that they enter, mm
OUT = 3.0
# least wall between two features, mm
WALL = 2.5


class Face:
    """A flat face for features that do not cross each other."""

    def __init__(self, origin, axis, direction, size, depth):
        self.frame = frame(origin, axis, direction)
        self.axis = self.frame[:, 2]
        self.size, self.depth = np.asarray(size, float), depth
        self.taken = []

    def at(self, x, y, z=0.0):
        return self.frame[:, :3] @ [x, y, z] + self.frame[:, 3]

    def place(self, x, y, turn=0.0, tilt=0.0):
        """The place of a tool whose z points out of the face; tilted about its own y."""
        c, s = np.cos(turn), np.sin(turn)
        ct, st = np.cos(tilt), np.sin(tilt)
        about = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ np.array([[ct, 0, st], [0, 1, 0], [-st, 0, ct]])
        return np.column_stack([self.frame[:, :3] @ about, self.at(x, y)])

    def room(self, rng, radius, tries=60):
        """A place for something of this radius, or None."""
        half = self.size / 2 - radius - WALL
        if (half < 0).any():
            return None
        for _ in range(tries):
            x, y = rng.uniform(-half, half)
            if all(np.hypot(x - u, y - v) > radius + r + WALL for u, v, r in self.taken):
                self.taken.append((x, y, radius))
                return x, y
        return None


def hole_feature(centre, axis, diameter, depth, through, **more):
    sizes = {"diameter_mm": diameter, "depth_mm": depth, "through": through}
    return Feature("hole", np.asarray(centre), np.asarray(axis), sizes, entry_mm=diameter, **more)


def drilled(part, rng, face, kind, group):
    """Holes of all kinds, square to a face or tilted."""
    d = round(rng.uniform(4.2, 12.0), 2)
    head = d * rng.uniform(1.5, 1.9)
    tilt = np.radians(rng.uniform(8, 25)) if kind == "tilted" else 0.0
    spot = face.room(rng, (head if kind in ("counterbored", "countersunk", "stepped") else d) / 2 * (1 + 2 * np.tan(tilt)) + 1)
    if spot is None:
        return
    turn = rng.uniform(0, 2 * np.pi)
    place = face.place(*spot, turn, tilt)
    axis, top = place[:, 2], face.at(*spot)
    through_depth = face.depth / np.cos(tilt)
    is_through = kind == "through" or kind in ("counterbored", "countersunk", "tilted") and rng.random() < 0.7
    depth = through_depth if is_through else round(rng.uniform(0.35, 0.8) * face.depth, 2)
    end = -depth - OUT if is_through else -depth
    main = hole_feature(top, axis, d, depth, is_through)
    if kind in ("through", "blind", "tilted"):
        part.cut(rod(d / 2, end, OUT + head), place, main)
        if kind == "blind" and rng.random() < 0.4:
            # the tip of a drill, 118°
            part.cut(cone((d / 2, 0.01), 0, d / 2 / np.tan(np.radians(59))).mirror([0, 0, 1]).translate([0, 0, -depth]), place, main, "floor")
        part.note(main)
        return
    step_depth = round(min(rng.uniform(0.15, 0.45) * depth, depth - 2.5), 2)
    if kind == "countersunk":
        full = np.radians(rng.choice([82.0, 90.0]))
        step_depth = (head - d) / 2 / np.tan(full / 2)
        if step_depth > depth - 3:
            return
        part.cut(rod(d / 2, end, OUT), place, main)
        slope = np.tan(full / 2)
        part.cut(cone((d / 2, head / 2 + OUT * slope), -step_depth, OUT), place, main, "floor")
        main.sizes |= {"cone_angle_deg": float(np.degrees(full)), "depth_mm": depth - step_depth}
        main.center_mm = face.at(*spot, -step_depth)
        part.note(main)
        return
    steps = [(head, step_depth), (d, depth)]
    if kind == "stepped":
        middle = (head + d) / 2
        steps = [(head, step_depth), (middle, step_depth + (depth - step_depth) * 0.45), (d, depth)]
    before = 0.0
    for number, (size, down) in enumerate(steps):
        is_last = number == len(steps) - 1
        one = hole_feature(face.at(*spot, -before), axis, size, down - before, is_through if is_last else False, group=group)
        if not is_last:
            # a step's floor is a ring: the group marks it as a step
            one.sizes["through"] = None
        part.cut(rod(size / 2, end if is_last else -down, OUT), place, one)
        part.note(one)
        before = down


def milled(part, rng, face, kind):
    """Slots, pockets, bosses and ribs."""
    width = round(rng.uniform(5.0, 9.5), 2)
    length = round(width * rng.uniform(2.2, 3.2), 2)
    depth = round(min(rng.uniform(2.5, 8.0), 0.7 * face.depth), 2)
    if kind in ("pocket", "island"):
        width = round(rng.uniform(10.0, 18.0), 2)
        length = round(width * rng.uniform(1.05, 1.6), 2)
    if kind == "island":
        width, length = width + 12, length + 12
    reach = np.hypot(width, length) / 2
    spot = face.room(rng, reach)
    if spot is None:
        return
    turn = rng.uniform(0, np.pi)
    place = face.place(*spot, turn)
    corner = {"slot_round": width / 2, "slot_flat": 0.0, "pocket": rng.choice([0.0, 1.5, 2.5]), "island": 2.5}[kind]
    is_through = kind.startswith("slot") and rng.random() < 0.25
    down = face.depth + OUT if is_through else depth
    name = "slot" if kind.startswith("slot") and length > (1.2 if corner else 2.0) * width else "pocket"
    sizes = {"width_mm": width, "length_mm": length, "depth_mm": face.depth if is_through else depth, "through": is_through}
    sizes["direction"] = place[:, 0]
    found = Feature(name, face.at(*spot), face.axis, sizes, entry_mm=width)
    found.is_optional = kind == "island"
    if kind == "island":
        island = round(rng.uniform(5, 8), 2)
        ring = rounded(length, width, corner) - circle(island / 2)
        part.cut(ring.extrude(down + OUT).translate([0, 0, -down]), place, found)
        boss = {"diameter_mm": island, "depth_mm": depth}
        part.note(Feature("boss", face.at(*spot, -depth), face.axis, boss, wall=list(found.wall), is_optional=True))
    else:
        part.cut(rounded(length, width, corner).extrude(down + OUT).translate([0, 0, -down]), place, found)
    part.note(found)


def boss(part, rng, face):
    d, height = round(rng.uniform(6, 14), 2), round(rng.uniform(3, 9), 2)
    spot = face.room(rng, d / 2 + 2.5)
    if spot is None:
        return
    found = Feature("boss", face.at(*spot), face.axis, {"diameter_mm": d, "depth_mm": height}, entry_mm=np.inf)
    part.add(rod(d / 2, -1.0, height), face.place(*spot), found)
    part.note(found)


def rib(part, rng, face):
    """A wall on a face: no hole, no slot."""
    width, height = rng.uniform(2.5, 5), rng.uniform(3, 8)
    length = rng.uniform(12, 25)
    spot = face.room(rng, length / 2)
    if spot is not None:
        tool = CrossSection.square([length, width], center=True).extrude(height + 1).translate([0, 0, -1])
        part.add(tool, face.place(*spot, rng.uniform(0, np.pi)))


def notch(part, rng, face):
    """A round cut at the rim of a face, open to the side: no hole."""
    d, depth = rng.uniform(6, 12), face.depth + OUT
    along = rng.uniform(-0.35, 0.35) * face.size[0]
    side = rng.choice([-1, 1]) * face.size[1] / 2
    if any(np.hypot(along - u, side - v) < d / 2 + r + WALL for u, v, r in face.taken):
        return
    face.taken.append((along, side, d / 2))
    out = rng.uniform(0.0, 0.3) * d / 2 * np.sign(side)
    found = Feature("notch", face.at(along, side + out), face.axis, {"diameter_mm": d, "depth_mm": face.depth}, entry_mm=d, is_optional=True)
    part.cut(rod(d / 2, -depth, OUT), face.place(along, side + out), found)
    part.note(found)


def t_slot(part, rng, face):
    """A slot across the whole face with a wider room below."""
    width = round(rng.uniform(6, 9), 2)
    y = rng.uniform(-0.25, 0.25) * face.size[1]
    wide, neck, room = width * 1.7, rng.uniform(3, 5), rng.uniform(4, 5.5)
    if neck + room > 0.8 * face.depth or abs(y) + wide / 2 + WALL > face.size[1] / 2:
        return
    if any(abs(y - v) < wide / 2 + r + WALL for _, v, r in face.taken):
        return
    face.taken += [(x, y, wide / 2) for x in np.linspace(-0.5, 0.5, 13) * face.size[0]]
    long = face.size[0] + 2 * OUT
    sizes = {"width_mm": width, "length_mm": face.size[0], "depth_mm": neck, "through": None, "direction": face.frame[:, 0]}
    found = Feature("slot", face.at(0, y), face.axis, sizes, entry_mm=width, is_optional=True, remark="T-slot")
    part.cut(CrossSection.square([long, width], center=True).extrude(neck + OUT).translate([0, 0, -neck]), face.place(0, y), found)
    part.cut(CrossSection.square([long, wide], center=True).extrude(room).translate([0, 0, -neck - room]), face.place(0, y), found, "floor")
    part.note(found)
    # each half of the room below the neck is a slot too, seen from the other
    for sign in (-1, 1):
        deep = (wide - width) / 2
        sizes = {"width_mm": room, "length_mm": face.size[0], "depth_mm": deep, "through": None, "direction": face.frame[:, 0]}
        out = -sign * face.frame[:, 1]
        part.note(Feature("slot", face.at(0, y + sign * width / 2, -neck - room / 2), out, sizes, is_optional=True, remark="undercut"))
        # and seen from an end the room goes through
        end = face.at(sign * face.size[0] / 2, y, -neck - room / 2)
        sizes = {"width_mm": room, "length_mm": wide, "depth_mm": face.size[0], "through": True, "direction": face.frame[:, 1]}
        part.note(Feature("slot", end, sign * face.frame[:, 0], sizes, is_optional=True, remark="end of a T-slot"))


DRILLED = ["through", "blind", "counterbored", "countersunk", "stepped", "tilted"]
MILLED = ["slot_round", "slot_flat", "pocket", "island"]


def features_on(part, rng, face, count, kinds):
    for number in range(count):
        kind = rng.choice(kinds)
        if kind in DRILLED:
            drilled(part, rng, face, kind, group=1000 * len(part.features) + number)
        elif kind in MILLED:
            milled(part, rng, face, kind)
        else:
            {"boss": boss, "rib": rib, "notch": notch, "t_slot": t_slot}[kind](part, rng, face)


def sides_of(length, width, height):
    """The four upright faces of a box that stands on z = 0 about the origin."""
    up = [0, 0, 1]
    middle = height / 2
    return [
        Face([length / 2, 0, middle], [1, 0, 0], up, [height, width], length),
        Face([-length / 2, 0, middle], [-1, 0, 0], up, [height, width], length),
        Face([0, width / 2, middle], [0, 1, 0], up, [height, length], width),
        Face([0, -width / 2, middle], [0, -1, 0], up, [height, length], width),
    ]


def box_blank(rng, length, width, height):
    """A box with sharp, rounded or chamfered upright edges, sometimes with a chamfer around its top."""
    corner = rng.choice([0.0, 0.0, 2.0, 5.0])
    outline = rounded(length, width, corner)
    if rng.random() < 0.3:
        outline = CrossSection.square([length - 6, width - 6], center=True).offset(3.0, JoinType.Square)
    if rng.random() < 0.4:
        edge = rng.uniform(0.8, 2.0)
        low = outline.extrude(height - edge)
        high = outline.offset(-edge, JoinType.Miter).extrude(0.001).translate([0, 0, height - 0.001])
        slab = outline.extrude(0.001).translate([0, 0, height - edge - 0.001])
        return low + Manifold.batch_hull([slab, high])
    return outline.extrude(height)


def block(rng):
    length, width, height = rng.uniform(45, 95), rng.uniform(35, 65), rng.uniform(14, 32)
    part = Part(box_blank(rng, length, width, height))
    top = Face([0, 0, height], [0, 0, 1], [1, 0, 0], [length - 4, width - 4], height)
    if rng.random() < 0.3:
        t_slot(part, rng, top)
    features_on(part, rng, top, rng.integers(3, 7), DRILLED + MILLED + ["boss", "rib", "notch"])
    for side in sides_of(length, width, height):
        if rng.random() < 0.5:
            # from the side only shallow holes, so that none crosses another
            side.depth = 8.0
            features_on(part, rng, side, 1, ["blind"])
    return part


def plate(rng):
    length, width, height = rng.uniform(60, 110), rng.uniform(40, 80), rng.uniform(5, 12)
    part = Part(box_blank(rng, length, width, height))
    top = Face([0, 0, height], [0, 0, 1], [1, 0, 0], [length - 4, width - 4], height)
    features_on(part, rng, top, rng.integers(4, 9), ["through", "counterbored", "countersunk", "slot_round", "slot_flat", "notch", "boss"])
    return part


def casting(rng):
    """Drafted walls, a wide fillet at the foot of its bosses' base, a machined bore."""
    length, width, height = rng.uniform(50, 90), rng.uniform(40, 65), rng.uniform(15, 28)
    draft = np.tan(np.radians(rng.uniform(1, 4))) * height
    outline = rounded(length, width, rng.uniform(3, 8))
    shrink = (1 - 2 * draft / length, 1 - 2 * draft / width)
    part = Part(outline.extrude(height, scale_top=shrink))
    size = [(length - 2 * draft) - 8, (width - 2 * draft) - 8]
    top = Face([0, 0, height], [0, 0, 1], [1, 0, 0], size, height)
    features_on(part, rng, top, rng.integers(2, 6), ["through", "blind", "counterbored", "boss", "pocket", "rib", "island"])
    return part


def shaft(rng):
    """A turned shaft along x that lies: steps, a taper, cross holes, keyways, a bore in its end."""
    radii = sorted(rng.uniform(9, 22, rng.integers(2, 4)))[::-1]
    lengths = rng.uniform(18, 40, len(radii))
    solid, x, pieces = None, 0.0, []
    for number, (radius, length) in enumerate(zip(radii, lengths)):
        is_taper = number == len(radii) - 1 and rng.random() < 0.3
        ends = (radius, radius * 0.75) if is_taper else (radius, radius)
        piece = cone(ends, 0, length) if is_taper else rod(radius, 0, length)
        piece = piece.translate([0, 0, x])
        solid = piece if solid is None else solid + piece
        pieces.append((x, length, radius, is_taper))
        x += length
    lying = frame([0, 0, 0], [1, 0, 0], [0, 1, 0])
    part = Part(solid.transform(lying))
    for start, length, radius, is_taper in pieces:
        if is_taper or length < 16:
            continue
        middle = start + length / 2
        kind = rng.choice(["keyway_round", "keyway_flat", "cross", "blind_radial", "none"])
        about = rng.choice([0.0, np.radians(rng.uniform(-25, 25))])
        out = np.array([0.0, np.sin(about), np.cos(about)])
        centre = np.array([middle, 0, 0]) + out * radius
        if kind.startswith("keyway"):
            width = round(min(rng.uniform(5, 8), 0.6 * radius), 2)
            long = round(min(rng.uniform(1.8, 3.0) * width, length - 6), 2)
            depth = round(rng.uniform(0.45, 0.6) * width + radius - np.sqrt(radius**2 - width**2 / 4), 2)
            corner = width / 2 if kind == "keyway_round" else 0.0
            if long < (1.3 if corner else 2.1) * width:
                continue
            sizes = {"width_mm": width, "length_mm": long, "depth_mm": depth, "through": False, "direction": np.array([1.0, 0, 0])}
            found = Feature("slot", centre, out, sizes, entry_mm=width, remark="keyway")
            tool = rounded(long, width, corner).extrude(depth + OUT + radius).translate([0, 0, -depth])
            part.cut(tool, frame(centre, out, [1, 0, 0]), found)
            part.note(found)
        elif kind in ("cross", "blind_radial"):
            d = round(rng.uniform(4.2, min(8.0, 0.7 * radius)), 2)
            is_through = kind == "cross"
            depth = 2 * radius if is_through else round(rng.uniform(0.4, 0.8) * radius, 2)
            found = hole_feature(centre, out, d, depth, is_through, remark="on a cylinder")
            part.cut(rod(d / 2, -depth - (OUT if is_through else 0), OUT + radius), frame(centre, out), found)
            part.note(found)
    if rng.random() < 0.6:
        d, depth = round(rng.uniform(5, radii[-1]), 2), round(rng.uniform(8, 16), 2)
        end = pieces[-1][2] * (0.75 if pieces[-1][3] else 1.0)
        if d / 2 < end - 2:
            found = hole_feature([x, 0, 0], [1, 0, 0], d, depth, False)
            part.cut(rod(d / 2, -depth, OUT), frame([x, 0, 0], [1, 0, 0]), found)
            part.note(found)
    return part


def bracket(rng):
    """An L with a foot and an upright wall, holes in both."""
    length, width, height, thick = rng.uniform(40, 70), rng.uniform(35, 55), rng.uniform(30, 50), rng.uniform(7, 12)
    foot = Manifold.cube([length, width, thick])
    wall = Manifold.cube([thick, width, height])
    solid = foot + wall
    if rng.random() < 0.5:
        # a fillet in the corner
        r = rng.uniform(3, 6)
        fill = Manifold.cube([r, width, r]).translate([thick, 0, thick])
        round_off = rod(r, 0, width + 2).rotate([-90, 0, 0]).translate([thick + r, -1, thick + r])
        solid += fill - round_off
    part = Part(solid)
    top = Face([(length + thick) / 2 + 3, width / 2, thick], [0, 0, 1], [1, 0, 0], [length - thick - 10, width - 4], thick)
    back = Face([0, width / 2, (height + thick) / 2], [-1, 0, 0], [0, 1, 0], [width - 4, height - thick - 6], thick)
    features_on(part, rng, top, rng.integers(1, 4), ["through", "counterbored", "countersunk", "slot_round"])
    features_on(part, rng, back, rng.integers(1, 3), ["through", "countersunk", "slot_round"])
    return part


def sheet(rng):
    """A thin plate, bent or flat, with punched holes and slots."""
    length, width, thick = rng.uniform(60, 100), rng.uniform(40, 70), rng.uniform(2.5, 4)
    part = Part(CrossSection.square([length, width], center=True).extrude(thick))
    if rng.random() < 0.5:
        part.add(Manifold.cube([thick, width, 18]), frame([length / 2 - thick, -width / 2, 0], [0, 0, 1], [1, 0, 0]))
    top = Face([-3, 0, thick], [0, 0, 1], [1, 0, 0], [length - 14, width - 4], thick)
    features_on(part, rng, top, rng.integers(3, 8), ["through", "slot_round", "notch"])
    return part


FAMILIES = {"block": block, "plate": plate, "casting": casting, "shaft": shaft, "bracket": bracket, "sheet": sheet}


def random_part(seed):
    """The name of its family and a part with at least one feature; the same seed gives the same part."""
    for attempt in range(100):
        rng = np.random.default_rng([seed, attempt])
        name = list(FAMILIES)[seed % len(FAMILIES)]
        part = FAMILIES[name](rng)
        if any(not feature.is_optional for feature in part.features):
            return name, part
    raise RuntimeError(f"no part with seed {seed}")
