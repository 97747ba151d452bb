# SPDX-License-Identifier: GPL-3.0-or-later
"""Files of measured BRDFs as others write them, made from functions, for tests of what reads them.

    PYTHONPATH=script .env/bench/bin/python tests/cli/measured_files.py

writes measured_golden.csv: what Mitsuba's plug-in `measured` says of the files that rgl() makes. It
needs Mitsuba 3 (script/requirements/bench.txt), which the tests do not. With --smallest FILE it
writes a small .bsdf file for script/fuzz.
"""

import sys
import tempfile
from pathlib import Path

import numpy as np
from measured_formats import direction, tensor

GOLDEN = Path(__file__).with_name("measured_golden.csv")


def hemisphere(count, seed, lowest=0.02):
    """Unit vectors (count, 3), uniform in solid angle above a height."""
    random = np.random.default_rng(seed)
    z = lowest + (1 - lowest) * random.uniform(size=count)
    phi = 2 * np.pi * random.uniform(size=count)
    s = np.sqrt(1 - z * z)
    return np.stack([s * np.cos(phi), s * np.sin(phi), z], -1)


def utia_directions():
    theta, phi = np.radians(np.arange(0, 76, 15)), np.radians(np.arange(0, 360, 7.5))
    w = direction(theta[:, None], phi).reshape(-1, 3)
    return np.repeat(w, len(w), 0), np.tile(w, (len(w), 1))


def utia(f):
    return np.ascontiguousarray(np.asarray(f, float).T, "<f8").tobytes()


def alta(name, output, *columns, more=""):
    """ALTA's text: the coordinates of a parametrisation, then the values."""
    values = 3 if output == "RGB_COLOR" else 1
    head = f"#DIM {len(columns) - values} {values}\n#PARAM_IN {name}\n#PARAM_OUT {output}\n{more}"
    rows = ("\t".join(f"{x:.15g}" for x in row) for row in zip(*columns, strict=True))
    return head + "\n".join(rows) + "\n"


def rgl_fields(kind, seed=7):
    """A made-up material: "isotropic", "anisotropic" (half of the azimuths), "quarter" of them, or
    "spectral". Not a BRDF of anything, but every number matters."""
    random = np.random.default_rng(seed)
    thetas = np.radians([0, 20, 40, 55, 70, 80, 88])
    phis = {"anisotropic": np.linspace(-np.pi, 0, 9), "quarter": np.linspace(-np.pi, -np.pi / 2, 6)}
    phis = phis.get(kind, np.zeros(1))
    channels = 13 if kind == "spectral" else 3
    slices, n, m = (len(phis), len(thetas)), 12, 16

    def smooth(*shape):
        """Positive, of the size of 1, and not constant along any axis."""
        return 0.3 + random.uniform(size=shape)

    # Rows of sigma are azimuths, on which isotropic files do not depend. Mitsuba 3.9.1 turns their
    # directions by a number that it does not set, so that only then its values are defined.
    sigma = smooth(m, m)
    if kind in ("isotropic", "spectral"):
        sigma[:] = sigma[0]
    u = np.linspace(0, 1, m)
    peak = np.exp(-8 * u**2)[None, :] * smooth(m, m)
    fields = {
        "description": np.frombuffer(b"Made up", np.uint8),
        "jacobian": np.array([1], np.uint8),
        "phi_i": phis,
        "theta_i": thetas,
        "ndf": peak,
        "sigma": sigma,
        "vndf": peak * smooth(*slices, m, m),
        "luminance": smooth(*slices, n, n),
        ("spectra" if kind == "spectral" else "rgb"): smooth(*slices, channels, n, n),
    }
    if kind == "spectral":
        fields["wavelengths"] = np.linspace(360, 800, channels)
    return {k: a if a.dtype == np.uint8 else a.astype(np.float32) for k, a in fields.items()}


def facets(azimuths):
    """A file whose visible normals are those of its facets, as in files that were measured, and
    whose other numbers are all 1; of a circle, half a circle or a quarter, as many azimuths."""
    size, circle = 48, len(azimuths) > 1
    u = np.linspace(0, 1, size)
    theta, phi = np.clip(u, 1e-3, 1) ** 2 * np.pi / 2, 2 * np.pi * u - np.pi
    m = direction(theta, phi[:, None])
    width = 0.2 * (1 + (0.5 * np.cos(2 * phi[:, None]) if circle else 0))
    ndf = np.exp(-((theta / width) ** 2)) + 1e-4
    density = ndf * u * np.sin(theta)  # in the unit square
    view = direction(np.radians(np.linspace(0, 85, 12)), np.asarray(azimuths)[:, None])

    def visible(w):
        return np.maximum(w @ m.reshape(-1, 3).T, 0).reshape(*w.shape[:-1], size, size) * density

    fields = {
        "description": np.frombuffer(b"Facets", np.uint8),
        "jacobian": np.array([1], np.uint8),
        "phi_i": np.asarray(azimuths),
        "theta_i": np.radians(np.linspace(0, 85, 12)),
        "ndf": ndf * np.ones((size, 1)),
        # The last azimuth is the first one.
        "sigma": 2 * np.pi**2 * visible(m)[..., :-1, :].mean((-1, -2)),
        "vndf": visible(view),
        "rgb": np.ones((len(azimuths), 12, 3, 8, 8)),
    }
    return {k: a if a.dtype == np.uint8 else a.astype(np.float32) for k, a in fields.items()}


KINDS = ("isotropic", "anisotropic", "quarter", "spectral")


def golden_directions(kind):
    """Light and view."""
    return hemisphere(40, KINDS.index(kind)), hemisphere(40, 100 + KINDS.index(kind))


def main():
    import mitsuba as mi

    rows = []
    for kind in KINDS:
        spectral = kind == "spectral"
        mi.set_variant("scalar_spectral" if spectral else "scalar_rgb")
        with tempfile.NamedTemporaryFile(suffix=".bsdf") as file:
            Path(file.name).write_bytes(tensor(rgl_fields(kind)))
            bsdf = mi.load_dict({"type": "measured", "filename": file.name})
        for light, view in zip(*golden_directions(kind), strict=True):
            at = mi.SurfaceInteraction3f()
            at.wi = mi.Vector3f(*view)

            def value(at=at, light=light, bsdf=bsdf):
                return np.array(bsdf.eval(mi.BSDFContext(), at, mi.Vector3f(*light))).ravel()

            if spectral:
                # At the wavelengths of the observer's table.
                found = []
                for nm in range(380, 781, 5):
                    at.wavelengths = [nm] * 4
                    found.append(value()[0])
            else:
                found = value()[:3]
            rows += [(kind, *light, *view, *found)]
    with GOLDEN.open("w", encoding="utf-8") as out:
        for kind, *numbers in rows:
            out.write(f"{kind}," + ",".join(f"{x:.9g}" for x in numbers) + "\n")
    print(f"{GOLDEN}: {len(rows)} pairs of directions", file=sys.stderr)


def smallest():
    """A .bsdf file of few numbers, to begin with when looking for ways to damage one."""
    ones = {"ndf": (2, 2), "sigma": (2, 2), "vndf": (1, 1, 2, 2), "rgb": (1, 1, 3, 2, 2)}
    fields = {name: np.ones(shape, np.float32) for name, shape in ones.items()}
    return tensor(fields | {name: np.zeros(1, np.float32) for name in ("phi_i", "theta_i")})


if __name__ == "__main__":
    if sys.argv[1:2] == ["--smallest"]:
        Path(sys.argv[2]).write_bytes(smallest())
    else:
        main()
