// SPDX-License-Identifier: GPL-3.0-or-later
// RGL's format (J. Dupuy, W. Jakob: An Adaptive Parameterization for Efficient Material Acquisition and Rendering,
// SIGGRAPH Asia 2018), as Rgl and Warp of generator/measured. Tables are slices of width x height numbers.

// Slices around a view, and their weights.
struct RglBlend {
    ivec4 slice;
    vec4 weight;
};

// Two places on an axis and the weight of the second.
vec3 rgl_located(sampler2D axes, int axis, int count, float x)
{
    if (count == 1 || x <= texelFetch(axes, ivec2(0, axis), 0).r)
        return vec3(0.0);
    if (x >= texelFetch(axes, ivec2(count - 1, axis), 0).r)
        return vec3(float(count - 1), float(count - 1), 0.0);
    int first = 0;
    while (texelFetch(axes, ivec2(first + 1, axis), 0).r <= x)
        ++first;
    float a = texelFetch(axes, ivec2(first, axis), 0).r, b = texelFetch(axes, ivec2(first + 1, axis), 0).r;
    return vec3(float(first), float(first + 1), (x - a) / (b - a));
}

vec3 rgl_at(sampler2D t, ivec2 size, RglBlend b, int x, int y)
{
    vec3 sum = vec3(0.0);
    for (int i = 0; i < 4; ++i) {
        if (b.weight[i] > 0.0) {
            int entry = (b.slice[i] * size.y + y) * size.x + x;
            sum += b.weight[i] * texelFetch(t, ivec2(entry & 1023, entry >> 10), 0).rgb;
        }
    }
    return sum;
}

// The cell of a place in the unit square, and the place in the cell.
ivec2 rgl_cell(ivec2 size, vec2 at, out vec2 inside)
{
    vec2 place = clamp(at, 0.0, 1.0) * vec2(size - 1);
    ivec2 cell = min(ivec2(place), size - 2);
    inside = place - vec2(cell);
    return cell;
}

vec3 rgl_lookup(sampler2D t, ivec2 size, RglBlend b, vec2 at)
{
    vec2 u;
    ivec2 c = rgl_cell(size, at, u);
    return mix(mix(rgl_at(t, size, b, c.x, c.y), rgl_at(t, size, b, c.x + 1, c.y), u.x),
        mix(rgl_at(t, size, b, c.x, c.y + 1), rgl_at(t, size, b, c.x + 1, c.y + 1), u.x), u.y);
}

// The place in the square of uniform numbers that a distribution maps to `at`.
vec2 rgl_invert(sampler2D t, ivec2 size, RglBlend b, vec2 at)
{
    vec2 u;
    ivec2 c = rgl_cell(size, at, u);
    float left = mix(rgl_at(t, size, b, c.x, c.y).r, rgl_at(t, size, b, c.x, c.y + 1).r, u.y);
    float right = mix(rgl_at(t, size, b, c.x + 1, c.y).r, rgl_at(t, size, b, c.x + 1, c.y + 1).r, u.y);
    float x = u.x * mix(left, right, 0.5 * u.x) / float(size.x - 1);
    if (c.x > 0)
        x += mix(rgl_at(t, size, b, c.x - 1, c.y).g, rgl_at(t, size, b, c.x - 1, c.y + 1).g, u.y);
    float low = rgl_at(t, size, b, size.x - 1, c.y).g, high = rgl_at(t, size, b, size.x - 1, c.y + 1).g;
    float whole = mix(low, high, u.y), y = u.y * mix(low, high, 0.5 * u.y) / float(size.y - 1);
    if (c.y > 0)
        y += rgl_at(t, size, b, 0, c.y - 1).b;
    return vec2(whole > 0.0 ? x / whole : 0.5, y);
}

float rgl_theta_to_unit(float theta) { return sqrt(theta / HALF_PI); }
float rgl_phi_to_unit(float phi) { return phi / (4.0 * HALF_PI) + 0.5; }
float rgl_elevation(vec3 w) { return measured_angle(length(w.xy), w.z); }

// The azimuth of a direction; that of the normal, which has none, is given.
float rgl_azimuth(vec3 w, float normal)
{
    float phi = measured_angle(abs(w.y), w.x);
    return w.xy == vec2(0.0) ? normal : w.y < 0.0 ? -phi : phi;
}

// `reduction`: how many times the azimuths in the file go into a circle. The file's wi is the view.
vec3 measured_rgl_eval(sampler2D axes, sampler2D ndf, sampler2D sigma, sampler2D vndf, sampler2D rgb, ivec2 views,
    ivec2 ndf_size, ivec2 sigma_size, ivec2 vndf_size, ivec2 rgb_size, bool isotropic, bool jacobian, int reduction,
    vec3 light, vec3 view)
{
    if (!(light.z > 0.0 && view.z > 0.0))
        return vec3(0.0);
    // Mirrored at planes through the normal, so that the view has an azimuth that was measured.
    vec3 turn = vec3(1.0);
    if (reduction >= 2) {
        bool y = view.y < 0.0, x = reduction == 4 ? view.x < 0.0 : y;
        turn = vec3(x ? 1.0 : -1.0, y ? 1.0 : -1.0, 1.0);
    }
    vec3 wi = view * turn, wo = light * turn, m = normalize(wi + wo);
    // A view in the plane of y = 0 has been turned from above: the azimuth of the normal is that of C++ for -0, -0.
    float normal = turn.x < 0.0 && view.xy == vec2(0.0) ? -2.0 * HALF_PI : 0.0;
    float phi = rgl_azimuth(wi, normal);
    if (reduction >= 2)
        phi = -abs(phi);
    float theta = rgl_elevation(wi);
    vec3 p = rgl_located(axes, 0, views.x, phi), t = rgl_located(axes, 1, views.y, theta);
    RglBlend one = RglBlend(ivec4(0), vec4(1.0, 0.0, 0.0, 0.0)), b;
    b.slice = ivec4(p.xxyy) * views.y + ivec4(t.xyxy);
    b.weight = vec4(1.0 - p.z, 1.0 - p.z, p.z, p.z) * vec4(1.0 - t.z, t.z, 1.0 - t.z, t.z);
    float phi_m = rgl_azimuth(m, normal) - (isotropic ? phi : 0.0);
    vec2 u_wi = vec2(rgl_theta_to_unit(theta), rgl_phi_to_unit(phi));
    vec2 u_m = vec2(rgl_theta_to_unit(rgl_elevation(m)), fract(rgl_phi_to_unit(phi_m)));
    float scale = 1.0 / light.z;
    if (jacobian) {
        float area = rgl_lookup(sigma, sigma_size, one, u_wi).r;
        if (!(area > 0.0))
            return vec3(0.0);
        scale *= rgl_lookup(ndf, ndf_size, one, u_m).r / (4.0 * area);
    }
    vec2 place = rgl_invert(vndf, vndf_size, b, u_m);
    return max(rgl_lookup(rgb, rgb_size, b, place) * scale, 0.0);
}
