// SPDX-License-Identifier: GPL-3.0-or-later
// A grid over the angles of light and view, in degrees, as GridTable of generator/measured.

float measured_degrees(float radians) { return radians * 57.2957795; }

// Two places on an axis and the weight of the second. A circle has the first after the last one.
vec3 measured_located(sampler2D axes, int axis, int count, bool circle, float x)
{
    float low = texelFetch(axes, ivec2(0, axis), 0).r, high = texelFetch(axes, ivec2(count - 1, axis), 0).r;
    float last = float(count - 1);
    if (count == 1)
        return vec3(0.0);
    if (circle) {
        x -= 360.0 * floor((x - low) / 360.0);
        if (x >= high)
            return vec3(last, 0.0, min((x - high) / (low + 360.0 - high), 1.0));
    }
    if (x <= low)
        return vec3(0.0);
    if (x >= high)
        return vec3(last, last, 0.0);
    int first = 0;
    for (int after = count - 1; after - first > 1;) {
        int middle = (first + after) / 2;
        if (texelFetch(axes, ivec2(middle, axis), 0).r <= x)
            first = middle;
        else
            after = middle;
    }
    float a = texelFetch(axes, ivec2(first, axis), 0).r, b = texelFetch(axes, ivec2(first + 1, axis), 0).r;
    return vec3(float(first), float(first + 1), (x - a) / (b - a));
}

// Of isotropic data, phi_o counts from phi_i; `mirrored`: it covers half a circle, and the other half is its mirror
// image.
vec3 measured_table_eval(sampler2D values, sampler2D axes, ivec4 sizes, bool mirrored, vec3 wi, vec3 wo)
{
    if (!(wi.z > 0.0 && wo.z > 0.0))
        return vec3(0.0);
    float phi_i = measured_degrees(sign(wi.y) * measured_angle(abs(wi.y), wi.x));
    float phi_o = measured_degrees(sign(wo.y) * measured_angle(abs(wo.y), wo.x));
    if (wi.y == 0.0 && wi.x < 0.0)
        phi_i = 180.0;
    if (wo.y == 0.0 && wo.x < 0.0)
        phi_o = 180.0;
    if (sizes.y == 1)
        phi_o -= phi_i;
    if (mirrored)
        phi_o = abs(phi_o - 360.0 * floor(phi_o / 360.0 + 0.5));
    vec3 at[4];
    at[0] = measured_located(axes, 0, sizes.x, false, measured_degrees(measured_angle(length(wi.xy), wi.z)));
    at[1] = measured_located(axes, 1, sizes.y, true, phi_i);
    at[2] = measured_located(axes, 2, sizes.z, false, measured_degrees(measured_angle(length(wo.xy), wo.z)));
    at[3] = measured_located(axes, 3, sizes.w, !mirrored, phi_o);
    vec3 sum = vec3(0.0);
    for (int i = 0; i < 16; ++i) {
        float weight = 1.0;
        int entry = 0;
        for (int k = 0; k < 4; ++k) {
            bool second = (i >> k & 1) == 1;
            entry = entry * sizes[k] + int(second ? at[k].y : at[k].x);
            weight *= second ? at[k].z : 1.0 - at[k].z;
        }
        if (weight > 0.0)
            sum += weight * texelFetch(values, ivec2(entry & 1023, entry >> 10), 0).rgb;
    }
    return sum;
}
