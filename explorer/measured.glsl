// SPDX-License-Identifier: GPL-3.0-or-later
// Measured data: what measured.js reads, looked up as generator/measured does.

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

// MERL's table, 90 x 90 x 180 entries of theta_h, theta_d and phi_d: an entry is the value in the middle of its cell.
// Red is negative where nothing was measured. A row of the texture holds nine of theta_d.
vec3 merl_eval(sampler2D entries, vec3 wi, vec3 wo)
{
    if (!(wi.z > 0.0 && wo.z > 0.0))
        return vec3(0.0);
    vec3 h = normalize(wi + wo);
    float s = length(h.xy);
    // Turned about z until h has azimuth 0, then about y until h is the z axis.
    vec2 turn = s > 0.0 ? h.xy / s : vec2(1.0, 0.0);
    vec3 w = vec3(dot(turn, wi.xy), turn.x * wi.y - turn.y * wi.x, wi.z);
    vec3 d = vec3(h.z * w.x - s * w.z, w.y, s * w.x + h.z * w.z);
    // By reciprocity, phi_d is modulo pi.
    float phi = measured_angle(abs(d.y), d.y < 0.0 ? -d.x : d.x);
    vec3 place = vec3(sqrt(measured_angle(s, h.z) / HALF_PI), measured_angle(length(d.xy), d.z) / HALF_PI,
        phi / (2.0 * HALF_PI)) * vec3(90.0, 90.0, 180.0) - 0.5;
    place.xy = clamp(place.xy, 0.0, 89.0);
    vec3 first = floor(place), second = place - first;
    vec3 sum = vec3(0.0);
    float weights = 0.0;
    for (int i = 0; i < 8; ++i) {
        ivec3 side = ivec3(i & 1, i >> 1 & 1, i >> 2);
        vec3 share = mix(1.0 - second, second, vec3(side));
        float weight = share.x * share.y * share.z;
        ivec3 cell = ivec3(first) + side;
        cell = ivec3(min(cell.xy, 89), (cell.z + 180) % 180);
        vec3 value = texelFetch(entries, ivec2(cell.y % 9 * 180 + cell.z, cell.x * 10 + cell.y / 9), 0).rgb;
        if (weight > 0.0 && value.r >= 0.0) {
            sum += weight * value;
            weights += weight;
        }
    }
    return weights > 0.0 ? sum / weights : vec3(0.0);
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
