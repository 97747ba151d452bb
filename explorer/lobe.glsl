// SPDX-License-Identifier: GPL-3.0-or-later
// Lights a lobe's mesh from the upper left of the viewer.

in vec3 facing;
in vec4 own;
out vec4 color;

void main()
{
    float size = length(facing);
    vec3 n = size > 0.0 ? facing / size : vec3(0.0, 0.0, 1.0);
    float light = 0.25 + 0.75 * max(0.0, dot(n, vec3(-0.45, 0.6, 0.66)));
    vec3 c = clamp(own.rgb * light, 0.0, 1.0);
    c = mix(12.92 * c, 1.055 * pow(max(c, vec3(1e-6)), vec3(1.0 / 2.4)) - 0.055, step(0.0031308, c));
    color = vec4(c * own.a, own.a);
}
