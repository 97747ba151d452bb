// SPDX-License-Identifier: GPL-3.0-or-later
// f in rgb and the pdf in alpha, for pairs of directions in two textures.

uniform sampler2D lights;
uniform sampler2D views;
out vec4 color;

void main()
{
    ivec2 at = ivec2(gl_FragCoord.xy);
    vec3 wi = texelFetch(lights, at, 0).xyz, wo = texelFetch(views, at, 0).xyz;
    color = vec4(eval_0(wi, wo), pdf_0(wi, wo));
}
