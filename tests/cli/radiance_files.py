# SPDX-License-Identifier: GPL-3.0-or-later
"""BSDFs as Radiance and WINDOW write them, made from functions, for tests of what reads them.

Conventions are those of Radiance's src/common/bsdf_m.c and bsdf_t.c, written down here a second
time: nothing of this is taken from the reader.
"""

import numpy as np

FULL = ((0, 5, 15, 25, 35, 45, 55, 65, 75, 90), (1, 8, 16, 20, 24, 24, 24, 16, 12))
#: Of Radiance since July 2022, and before.
HALF = ((0, 6.5, 19.5, 32.5, 45.5, 58.5, 71.5, 90), (1, 8, 12, 16, 20, 12, 8))
OLD_HALF = ((0, 6.5, 19.5, 32.5, 46.5, 61.5, 76.5, 90), (1, 8, 12, 16, 20, 12, 4))
QUARTER = ((0, 9, 27, 45, 63, 90), (1, 8, 12, 12, 8))
OLD_QUARTER = ((0, 9, 27, 46, 66, 90), (1, 8, 12, 12, 8))
#: Rows of X, Y and Z of red, green and blue in genBSDF.
XYZ_OF_RADIANCE = np.array(
    [[0.5141, 0.3239, 0.1620], [0.2651, 0.6701, 0.0648], [0.0241, 0.1229, 0.8530]]
)


def places(basis, count=4):
    """Unit vectors (patches, count * count, 3), spread evenly in projected solid angle."""
    out = []
    even = (np.arange(count) + 0.5) / count
    for low, high, number in zip(basis[0][:-1], basis[0][1:], basis[1], strict=True):
        first, last = np.sin(np.radians([low, high])) ** 2
        s = np.sqrt(first + (last - first) * even)[:, None]
        for k in range(number):
            phi = 2 * np.pi * (k - 0.5 + even) / number
            w = s * np.cos(phi), s * np.sin(phi), np.sqrt(1 - s**2) + 0 * phi
            out.append(np.stack(w, -1).reshape(-1, 3))
    return np.array(out)


def patch_of(basis, w):
    """The numbers of the patches that directions are in."""
    theta = np.degrees(np.arccos(np.clip(w[:, 2], 0, 1)))
    ring = np.minimum(np.searchsorted(basis[0], theta, side="right") - 1, len(basis[1]) - 1)
    number = np.array(basis[1])[ring]
    turns = np.arctan2(w[:, 1], w[:, 0]) / (2 * np.pi)
    first = np.cumsum((0, *basis[1]))
    return first[ring] + np.floor(turns * number + 0.5).astype(int) % number


def solid_angles(basis):
    """Of patches, projected."""
    bounds = np.cos(np.radians(basis[0])) ** 2
    rings = np.pi * (bounds[:-1] - bounds[1:])
    return np.repeat(rings / basis[1], basis[1])


def to_world(side, incident, outgoing):
    """wi and wo in the frame of a side, of directions in the file: incident ones are where the
    light goes. The front is the pane turned about its vertical axis."""
    wi, wo = incident * [-1, -1, 1], outgoing * [1, 1, 1]
    if side == "Front":
        wi, wo = wi * [-1, 1, 1], wo * [-1, 1, 1]
    return wi, wo


def averages(f, basis, side="Front", count=4):
    """The matrix of f(wi, wo): rows are outgoing patches, columns incident ones."""
    at = places(basis, count)
    patches, each = at.shape[:2]
    outgoing = at.reshape(-1, 3)
    out = np.zeros((patches, patches))
    for i in range(patches):
        for incident in at[i]:
            wi, wo = to_world(side, np.broadcast_to(incident, outgoing.shape), outgoing)
            out[:, i] += f(wi, wo).reshape(patches, each).mean(1) / each
    return out


def table(name, basis):
    """The element that describes a basis."""
    blocks = "".join(
        f"<AngleBasisBlock><Theta>{(low + high) / 2}</Theta><nPhis>{number}</nPhis><ThetaBounds>"
        f"<LowerTheta>{low}</LowerTheta><UpperTheta>{high}</UpperTheta></ThetaBounds>"
        "</AngleBasisBlock>\n"
        for low, high, number in zip(basis[0][:-1], basis[0][1:], basis[1], strict=True)
    )
    return f"<AngleBasis><AngleBasisName>{name}</AngleBasisName>{blocks}</AngleBasis>"


def matrix(values, basis="LBNL/Klems Full", direction="Reflection Front", wavelength="Visible"):
    rows = "\n".join(",\t".join(f"{v:.8g}" for v in row) + "," for row in values)
    return data(rows, direction, wavelength, basis)


def data(text, direction="Reflection Front", wavelength="Visible", basis="LBNL/Klems Full"):
    """A matrix of numbers, or a tree where `basis` is None."""
    named = "<AngleBasis>LBNL/Shirley-Chiu</AngleBasis>"
    if basis is not None:
        named = f"<ColumnAngleBasis>{basis}</ColumnAngleBasis>"
        named += f"<RowAngleBasis>{basis}</RowAngleBasis>"
    return (
        "<WavelengthData><LayerNumber>System</LayerNumber>"
        f'<Wavelength unit="Integral">{wavelength}</Wavelength>'
        "<SourceSpectrum>CIE Illuminant D65 1nm.ssp</SourceSpectrum><WavelengthDataBlock>\n"
        f"<WavelengthDataDirection>{direction}</WavelengthDataDirection>{named}"
        f"<ScatteringDataType>BTDF</ScatteringDataType><ScatteringData>\n{text}\n"
        "</ScatteringData></WavelengthDataBlock></WavelengthData>\n"
    )


def bsdf(*blocks, structure="Columns", described="", name="Cloth", maker="Weaver"):
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n<!-- File produced by: a test -->\n'
        '<WindowElement xmlns="http://windows.lbl.gov">\n<WindowElementType>System'
        f"</WindowElementType>\n<Optical>\n<Layer>\n<Material><Name>{name}</Name>"
        f"<Manufacturer>{maker}</Manufacturer></Material>\n<DataDefinition>"
        f"<IncidentDataStructure>{structure}</IncidentDataStructure>{described}"
        f"</DataDefinition>\n{''.join(blocks)}</Layer>\n</Optical>\n</WindowElement>\n"
    )


def square(x, y):
    """Shirley's and Chiu's map from the disk to the unit square, by its inverse: the sides of the
    square are arcs, and its diagonals the directions at 45 degrees."""
    r, phi = np.hypot(x, y), np.arctan2(y, x) % (2 * np.pi)
    turns = np.round(phi / (np.pi / 2))
    along = r * (phi - turns * np.pi / 2) / (np.pi / 4)
    quarter = turns.astype(int) % 4
    a = np.choose(quarter, [r, -along, -r, along])
    b = np.choose(quarter, [along, r, -along, -r])
    return np.stack([(a + 1) / 2, (b + 1) / 2], -1)


class Tree:
    """A tree of random numbers, as text and as what it has at places (n, dimensions)."""

    def __init__(self, dimensions, depth, random, low=0.0, high=1.0):
        self.dimensions = dimensions
        branches = depth > 0 and (depth > 2 or random.uniform() < 0.4)
        if branches:
            self.children = [
                Tree(dimensions, depth - 1, random, low, high) for _ in range(2**dimensions)
            ]
            self.text = "{\n" + " ".join(c.text for c in self.children) + "}"
            return
        self.children = None
        cells = 2 ** int(random.integers(0, 2))
        self.grid = random.uniform(low, high, (cells,) * dimensions).round(5)
        self.text = "{ " + " ".join(f"{v:.5f}" for v in self.grid.ravel()) + " }"

    def at(self, places):
        places = np.atleast_2d(places)
        if self.children is None:
            cells = len(self.grid)
            return self.grid[tuple(np.minimum((places * cells).astype(int), cells - 1).T)]
        half = places >= 0.5
        which = (half << np.arange(self.dimensions)).sum(1)
        out = np.zeros(len(places))
        for k, child in enumerate(self.children):
            here = which == k
            if here.any():
                out[here] = child.at(2 * places[here] - half[here])
        return out


def tree_places(dimensions, incident, outgoing):
    """Coordinates in a tree of directions in the file."""
    if dimensions == 4:
        return np.hstack([square(*incident[:, :2].T), square(*outgoing[:, :2].T)])
    phi = np.arctan2(incident[:, 1], incident[:, 0])
    c, s = np.cos(phi), np.sin(phi)
    x, y = outgoing[:, 0], outgoing[:, 1]
    r = np.hypot(incident[:, 0], incident[:, 1])
    return np.column_stack([(1 - r) / 2, square(c * x + s * y, c * y - s * x)])
