// SPDX-License-Identifier: GPL-3.0-or-later
// The lit sphere, which all pictures show: x is right, y up, z towards the viewer, who is far away.

const float PI = 3.14159265;

// The point of the sphere in this pixel, moved by an offset in pixels; alpha 0 where there is none.
vec4 sphere_normal(vec2 size, vec2 offset)
{
    vec2 p = ((gl_FragCoord.xy + offset) / size * 2.0 - 1.0) * 1.04;
    float r2 = dot(p, p);
    return r2 < 1.0 ? vec4(p, sqrt(1.0 - r2), 1.0) : vec4(0.0);
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
