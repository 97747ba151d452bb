// SPDX-License-Identifier: GPL-3.0-or-later
// Adds one sample of the sphere or knot under a distant lamp. A white matte surface that faces the lamp shows 1.

uniform sampler2D sum;
uniform vec2 size;
uniform vec2 offset;
uniform vec3 lamp;
out vec4 color;

void main()
{
    color = texelFetch(sum, ivec2(gl_FragCoord.xy), 0);
    vec4 n = seen_normal(size, offset);
    if (n.w == 0.0)
        return;
    mat3 frame = frame_of(n.xyz);
    vec3 wi = lamp * frame, wo = vec3(0, 0, 1) * frame;
    color += vec4(eval_0(wi, wo) * abs(wi.z) * PI, 1.0);
}
