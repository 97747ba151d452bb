// SPDX-License-Identifier: GPL-3.0-or-later
// The lit sphere or knot, which all pictures show: x is right, y up, z towards the viewer, who is far away.

const float PI = 3.14159265;

uniform bool is_knot;

// Two strands that wind one and a half times around a circle and are one: a trefoil. Something less than the distance to
// its surface, which is negative inside.
float knot_distance(vec3 p)
{
    float turn = 1.5 * atan(p.y, p.x);
    vec2 across = vec2(length(p.xy) - 0.58, p.z);
    float c = cos(turn), s = sin(turn);
    across = vec2(c * across.x + s * across.y, c * across.y - s * across.x);
    return (length(vec2(abs(across.x) - 0.22, across.y)) - 0.19) * 0.6;
}

// The normal where the ray through p, which is at z = 0, meets the knot first; alpha 0 if it does not.
vec4 knot_normal(vec2 p)
{
    // The knot's axes in the picture: it is tilted.
    const mat3 axes = mat3(0.9689, 0.2474, 0.0, -0.2037, 0.7979, 0.5673, 0.1404, -0.5497, 0.8235);
    float z = sqrt(1.0 - dot(p, p));
    for (int i = 0; i < 128; ++i) {
        vec3 at = vec3(p, z) * axes;
        float d = knot_distance(at);
        if (d < 5e-4) {
            const vec2 e = vec2(2e-3, 0.0);
            vec3 n = axes * vec3(knot_distance(at + e.xyy) - knot_distance(at - e.xyy),
                knot_distance(at + e.yxy) - knot_distance(at - e.yxy), knot_distance(at + e.yyx) - knot_distance(at - e.yyx));
            // What is seen faces the viewer, also where rounding tells otherwise.
            n = normalize(n);
            return vec4(normalize(vec3(n.xy, max(n.z, 1e-3))), 1.0);
        }
        z -= d;
        if (z < -1.0)
            break;
    }
    return vec4(0.0);
}

// The normal of what is seen in this pixel, moved by an offset in pixels; alpha 0 where there is nothing.
vec4 seen_normal(vec2 size, vec2 offset)
{
    vec2 p = ((gl_FragCoord.xy + offset) / size * 2.0 - 1.0) * 1.04;
    float r2 = dot(p, p);
    if (r2 >= 1.0)
        return vec4(0.0);
    return is_knot ? knot_normal(p) : vec4(p, sqrt(1.0 - r2), 1.0);
}

// The local frame: z is the normal, x the object's axis, which is y here, laid into the surface.
mat3 frame_of(vec3 n)
{
    vec3 axis = abs(n.y) < 0.999999 ? vec3(0, 1, 0) : vec3(1, 0, 0);
    vec3 t = normalize(axis - n * dot(n, axis));
    return mat3(t, cross(n, t), n);
}

// Four numbers in [0, 1), by a hash (M. Jarzynski, M. Olano: Hash Functions for GPU Rendering, JCGT 9(3), 2020: pcg4d).
vec4 random4(uvec4 v)
{
    v = v * 1664525u + 1013904223u;
    v.x += v.y * v.w; v.y += v.z * v.x; v.z += v.x * v.y; v.w += v.y * v.z;
    v ^= v >> 16u;
    v.x += v.y * v.w; v.y += v.z * v.x; v.z += v.x * v.y; v.w += v.y * v.z;
    return vec4(v >> 8u) / 16777216.0;
}
