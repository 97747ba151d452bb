// SPDX-License-Identifier: GPL-3.0-or-later
// MERL's table, 90 x 90 x 180 entries of theta_h, theta_d and phi_d: an entry is the value in the middle of its cell.
// Red is negative where nothing was measured. A row of the texture holds nine of theta_d.
vec3 measured_merl_eval(sampler2D entries, vec3 wi, vec3 wo)
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
