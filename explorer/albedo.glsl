// SPDX-License-Identifier: GPL-3.0-or-later
// The share of light that is reflected or let through: a column an angle of view, a row a share of the samples.

uniform float columns;
uniform float azimuth;
out vec4 color;

const int SAMPLES = 32;

void main()
{
    float theta = floor(gl_FragCoord.x) / columns * 1.57079633;
    theta = min(theta, 1.5690);
    vec3 wo = vec3(sin(theta) * cos(azimuth), sin(theta) * sin(azimuth), cos(theta));
    vec3 total = vec3(0.0);
#ifdef SCATTERS_0
    // Multiples of powers of a root of x^4 = x + 1 fill the cube evenly.
    float first = floor(gl_FragCoord.y) * float(SAMPLES);
    for (int i = 0; i < SAMPLES; ++i) {
        vec3 u = fract(0.5 + (first + float(i) + 1.0) * vec3(0.819172513, 0.671043607, 0.549700478));
        vec3 wi, weight;
        float pdf;
        sample_0(wo, u, wi, weight, pdf);
        total += pdf > 0.0 ? weight : vec3(0.0);
    }
    total /= float(SAMPLES);
#endif
#ifdef MIRROR_0
    total += mirror_0(wo);
#endif
#ifdef TRANSMIT_0
    total += transmit_0(wo);
#endif
    color = vec4(total, 1.0);
}
