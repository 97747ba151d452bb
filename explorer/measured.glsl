// SPDX-License-Identifier: GPL-3.0-or-later
// Measured data: what their look-ups share, and the sampling of directions.

const float HALF_PI = 1.57079633;

// atan2 for a y that is not negative; from 0 to pi.
float measured_angle(float y, float x)
{
    float a = abs(x);
    if (max(a, y) == 0.0)
        return 0.0;
    float angle = y < a ? brdfc_atan(y / a) : HALF_PI - brdfc_atan(a / y);
    return x < 0.0 ? 2.0 * HALF_PI - angle : angle;
}

// Directions are drawn from rows of half vectors and from the cosine, as halfVectorRows() describes.
const int HALF_ROWS = 90;
float measured_matte(sampler2D rows) { return texelFetch(rows, ivec2(HALF_ROWS, 0), 0).a; }

float measured_pdf(sampler2D rows, vec3 wi, vec3 wo)
{
    if (!(wi.z > 0.0 && wo.z > 0.0))
        return 0.0;
    vec3 h = normalize(wi + wo);
    float row = sqrt(measured_angle(length(h.xy), h.z) / HALF_PI) * float(HALF_ROWS);
    float density = texelFetch(rows, ivec2(min(int(row), HALF_ROWS - 1), 0), 0).g;
    return mix(density / (4.0 * dot(wo, h)), wi.z / (2.0 * HALF_PI), measured_matte(rows));
}

// The direction of light, of length 0 if the sample is lost.
vec3 measured_sample(sampler2D rows, vec3 wo, vec3 u)
{
    float phi = 4.0 * HALF_PI * u.z;
    vec3 wi;
    if (u.x < measured_matte(rows)) {
        float r = sqrt(u.y);
        wi = vec3(r * brdfc_cos(phi), r * brdfc_sin(phi), sqrt(max(0.0, 1.0 - u.y)));
    } else {
        int row = 0;
        for (int after = HALF_ROWS - 1; row < after;) {
            int middle = (row + after) / 2;
            if (texelFetch(rows, ivec2(middle, 0), 0).r <= u.y)
                row = middle + 1;
            else
                after = middle;
        }
        vec4 at = texelFetch(rows, ivec2(row, 0), 0);
        float before = row > 0 ? texelFetch(rows, ivec2(row - 1, 0), 0).r : 0.0;
        float v = mix(at.b, at.a, at.r > before ? clamp((u.y - before) / (at.r - before), 0.0, 1.0) : 0.5);
        float s = 2.0 * sqrt(v * (1.0 - v));
        vec3 h = vec3(s * brdfc_cos(phi), s * brdfc_sin(phi), 1.0 - 2.0 * v);
        wi = 2.0 * dot(h, wo) * h - wo;
        if (dot(h, wo) <= 0.0)
            return vec3(0.0);
    }
    return wi.z > 0.0 ? wi : vec3(0.0);
}
