// SPDX-License-Identifier: GPL-3.0-or-later
// Shows sums of samples, whose alpha counts those that met an object; or the difference of two, in false colours.

uniform sampler2D sum;
uniform sampler2D other;
uniform bool difference;
uniform float scale;
uniform float samples;
out vec4 color;

void main()
{
    ivec2 at = ivec2(gl_FragCoord.xy);
    vec4 a = texelFetch(sum, at, 0);
    if (a.a == 0.0) {
        color = vec4(0.0);
        return;
    }
    vec3 c = a.rgb / a.a;
    if (difference) {
        vec4 b = texelFetch(other, at, 0);
        // Orange: the first is brighter; blue: the second.
        float d = dot(c - b.rgb / max(b.a, 1.0), vec3(1.0 / 3.0)) * scale;
        c = vec3(max(d, 0.0), 0.3 * abs(d), max(-d, 0.0));
    } else {
        c *= scale;
    }
    c = clamp(c, 0.0, 1.0);
    c = mix(12.92 * c, 1.055 * pow(max(c, vec3(1e-6)), vec3(1.0 / 2.4)) - 0.055, step(0.0031308, c));
    float cover = a.a / samples;
    color = vec4(c * cover, cover);
}
