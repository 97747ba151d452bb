// SPDX-License-Identifier: GPL-3.0-or-later
// Adds one sample of the sphere or knot in an environment: sky, sun, softbox and a chequered ground. Directions are drawn from
// the model, the cosine, the sun and the softbox, and weighed by the balance heuristic of multiple importance sampling
// (E. Veach, L. Guibas: Optimally Combining Sampling Techniques for Monte Carlo Rendering, SIGGRAPH 1995).

uniform sampler2D sum;
uniform vec2 size;
uniform vec2 offset;
uniform vec3 lamp;
uniform int number;
out vec4 color;

const float SUN_COS = 0.9986;                   // a radius of 3 degrees
const vec3 SUN = vec3(1.0, 0.9, 0.75) * 160.0;  // radiance
const vec3 BOX_CENTRE = vec3(1.5, 0.9, 0.9);
const vec3 BOX_X = vec3(0.257, 0.0, -0.429);  // half the width
const vec3 BOX_Y = vec3(0.0, 0.5, 0.0);      // half the height
const vec3 BOX_NORMAL = vec3(-0.858, 0.0, -0.514);
const vec3 BOX = vec3(5.0);

// The pdf of a point drawn uniformly on the softbox, per solid angle; 0 beside it.
float box_pdf(vec3 d)
{
    float facing = dot(d, BOX_NORMAL);
    if (facing > -1e-4)
        return 0.0;
    float t = dot(BOX_CENTRE, BOX_NORMAL) / facing;
    vec3 at = d * t - BOX_CENTRE;
    vec2 inside = abs(vec2(dot(at, BOX_X) / dot(BOX_X, BOX_X), dot(at, BOX_Y) / dot(BOX_Y, BOX_Y)));
    if (t < 0.0 || max(inside.x, inside.y) > 1.0)
        return 0.0;
    return t * t / (-facing * 4.0 * length(BOX_X) * length(BOX_Y));
}

float sun_pdf(vec3 d) { return dot(d, lamp) > SUN_COS ? 1.0 / (2.0 * PI * (1.0 - SUN_COS)) : 0.0; }

vec3 radiance(vec3 d)
{
    vec3 c;
    if (d.y > 0.0) {
        c = mix(vec3(0.75, 0.78, 0.82), vec3(0.18, 0.32, 0.62), sqrt(d.y)) * 0.8;
    } else {
        vec2 at = d.xz / min(d.y, -1e-3) * 1.5;
        float light = fract((floor(at.x) + floor(at.y)) * 0.5) < 0.25 ? 0.30 : 0.12;
        c = mix(vec3(0.21, 0.20, 0.19), vec3(light), smoothstep(0.02, 0.2, -d.y));
    }
    if (box_pdf(d) > 0.0)
        c = BOX;
    if (sun_pdf(d) > 0.0)
        c += SUN;
    return c;
}

#ifdef TRANSMIT_0
// Light that reaches the viewer through a solid ball of radius 1, from where the ray enters it. Inside, all angles are
// equal: at each point some light leaves, and the rest goes on. A knot's points are taken for those of the ball with the
// same normal.
vec3 through_ball(vec3 n, mat3 frame, vec3 wo, float ior)
{
    vec3 d = refract(-vec3(0, 0, 1), n, 1.0 / ior), share = transmit_0(wo), light = vec3(0.0);
    if (dot(d, d) == 0.0)
        return light;
    for (int i = 0; i < 6; ++i) {
        float way = -2.0 * dot(n, d);
        n = normalize(n + d * way);
        frame = frame_of(n);
        share *= inside_0(way);
        wo = -d * frame;
        vec3 leaves = refract(d, -n, ior);
        if (dot(leaves, leaves) > 0.0)
            light += share * transmit_0(wo) * radiance(leaves);
#ifdef MIRROR_0
        share *= mirror_0(wo);
#endif
        d = reflect(d, n);
    }
    return light;
}
#endif

void main()
{
    color = texelFetch(sum, ivec2(gl_FragCoord.xy), 0);
    vec4 n = seen_normal(size, offset);
    if (n.w == 0.0)
        return;
    mat3 frame = frame_of(n.xyz);
    vec3 wo = vec3(0, 0, 1) * frame, light = vec3(0.0);
#ifdef SCATTERS_0
    uvec4 seed = uvec4(gl_FragCoord.xy, uint(number), 0u);
    vec4 u = random4(seed), v = random4(seed + uvec4(0u, 0u, 0u, 1u)), w = random4(seed + uvec4(0u, 0u, 0u, 2u));
    for (int k = 0; k < 4; ++k) {
        vec3 wi, weight;
        float own = 1.0;
        if (k == 0) {
            sample_0(wo, u.xyz, wi, weight, own);
        } else if (k == 1) {
            float r = sqrt(v.x), phi = 2.0 * PI * v.y;
            wi = vec3(r * cos(phi), r * sin(phi), sqrt(max(0.0, 1.0 - v.x)));
#ifdef THROUGH_0
            if (u.w < 0.5)
                wi.z = -wi.z;
#endif
        } else if (k == 2) {
            float c = mix(1.0, SUN_COS, v.z), s = sqrt(max(0.0, 1.0 - c * c)), phi = 2.0 * PI * v.w;
            wi = (frame_of(lamp) * vec3(s * cos(phi), s * sin(phi), c)) * frame;
        } else {
            wi = normalize(BOX_CENTRE + (2.0 * w.x - 1.0) * BOX_X + (2.0 * w.y - 1.0) * BOX_Y) * frame;
        }
        // Below the surface, or lost by the model's sampling: nothing.
        if (!(own > 0.0) || dot(wi, wi) < 0.5)
            continue;
#ifdef THROUGH_0
        float cosine_pdf = abs(wi.z) / (2.0 * PI);
#else
        if (wi.z <= 0.0)
            continue;
        float cosine_pdf = wi.z / PI;
#endif
        vec3 d = frame * wi;
        float p = pdf_0(wi, wo) + cosine_pdf + sun_pdf(d) + box_pdf(d);
        light += eval_0(wi, wo) * radiance(d) * abs(wi.z) / p;
    }
#endif
#ifdef MIRROR_0
    light += mirror_0(wo) * radiance(frame * vec3(-wo.xy, wo.z));
#endif
#ifdef TRANSMIT_0
    vec3 iors = iors_0();
    for (int i = 0; i < 3; ++i)
        light[i] += through_ball(n.xyz, frame, wo, iors[i])[i];
#endif
    color += vec4(light, 1.0);
}
