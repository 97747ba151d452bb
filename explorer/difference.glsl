// SPDX-License-Identifier: GPL-3.0-or-later
// Two models compared, for views by column: red sums |f - g| cos, green f cos, with directions drawn from both. The last
// column is the view at `angle`, the others are views from 0 to 90 degrees.

uniform float columns;
uniform float angle;
uniform float azimuth;
out vec4 color;

const int SAMPLES = 32;

float mean(vec3 c) { return (c.r + c.g + c.b) / 3.0; }

void main()
{
    float column = floor(gl_FragCoord.x);
    float theta = column + 1.0 == columns ? min(angle, 1.5690) : (column + 0.5) / (columns - 1.0) * 1.57079633;
    vec3 wo = vec3(sin(theta) * cos(azimuth), sin(theta) * sin(azimuth), cos(theta));
    vec2 total = vec2(0.0);
    float first = floor(gl_FragCoord.y) * float(SAMPLES);
    for (int i = 0; i < SAMPLES; ++i) {
        vec3 u = fract(0.5 + (first + float(i) + 1.0) * vec3(0.819172513, 0.671043607, 0.549700478));
        for (int k = 0; k < 2; ++k) {
            vec3 wi = vec3(0.0), weight;
            float own = 0.0;
#ifdef SCATTERS_0
            if (k == 0)
                sample_0(wo, u, wi, weight, own);
#endif
#ifdef SCATTERS_1
            if (k == 1)
                sample_1(wo, u, wi, weight, own);
#endif
            if (!(own > 0.0))
                continue;
            float p = pdf_0(wi, wo) + pdf_1(wi, wo);
            if (!(p > 0.0))
                continue;
            vec3 f = eval_0(wi, wo), g = eval_1(wi, wo);
            total += vec2(mean(abs(f - g)), mean(f)) * abs(wi.z) / p;
        }
    }
    total /= float(SAMPLES);
    vec3 m = mirror_0(wo), t = transmit_0(wo);
    total += vec2(mean(abs(m - mirror_1(wo)) + abs(t - transmit_1(wo))), mean(m + t));
    color = vec4(total, 0.0, 1.0);
}
