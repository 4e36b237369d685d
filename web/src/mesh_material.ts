/**
 * Shading of the mesh: flat faces, whose normals come from the derivatives of the place on the screen, so that a moving mesh needs no
 * normals; the shader chooses the colour of a vertex, so that another choice uploads nothing.
 */
import { GLSL3, ShaderMaterial, DoubleSide, Vector3 } from "three";
import { FAR } from "./mesh_store";
import { type ColourMode, SCALE_STEPS, UNKNOWN_COLOUR, rgb } from "./colours";

/** Categories at most. */
const CATEGORIES = 4;

const VERTEX = /* glsl */ `
  in float variance;
  in vec4 quality;
  in float deviation;
  uniform int mode;
  uniform float scaleEnd;
  uniform vec3 categories[${CATEGORIES}];
  out vec3 vPlace;
  out vec3 vColour;
  out float vScale;
  out float vUnknown;
  void main() {
    vec4 place = modelViewMatrix * vec4(position, 1.0);
    vPlace = place.xyz;
    vColour = categories[int(mode == 3 ? quality.y : quality.x) & 3];
    vScale = mode == 2 ? 0.5 + 0.5 * deviation / scaleEnd : sqrt(max(variance, 0.0)) / scaleEnd;
    vUnknown = mode == 1 && variance < 0.0 || mode == 2 && deviation >= ${FAR.toFixed(1)} ? 1.0 : 0.0;
    gl_Position = projectionMatrix * place;
  }
`;

const FRAGMENT = /* glsl */ `
  precision highp float;
  uniform int mode;
  uniform vec3 scale[${SCALE_STEPS}];
  uniform vec3 unknown;
  in vec3 vPlace;
  in vec3 vColour;
  in float vScale;
  in float vUnknown;
  out vec4 colour;
  void main() {
    vec3 normal = normalize(cross(dFdx(vPlace), dFdy(vPlace)));
    vec3 own = vColour;
    if (mode == 1 || mode == 2) {
      float at = clamp(vScale, 0.0, 1.0) * float(${SCALE_STEPS - 1});
      int step = min(int(at), ${SCALE_STEPS - 2});
      own = mix(mix(scale[step], scale[step + 1], at - float(step)), unknown, clamp(vUnknown, 0.0, 1.0));
    }
    float facing = abs(dot(normal, normalize(-vPlace)));
    float above = 0.5 + 0.5 * dot(normal, normalize(vec3(-0.35, 0.8, 0.5)));
    float light = 0.40 + 0.42 * facing + 0.28 * above;
    colour = vec4(own * light, 1.0);
  }
`;

const MODE_NUMBERS: Record<ColourMode["name"], number> = { support: 0, uncertainty: 1, deviation: 2, outlier: 3 };

export class MeshMaterial extends ShaderMaterial {
  constructor() {
    super({
      glslVersion: GLSL3,
      vertexShader: VERTEX,
      fragmentShader: FRAGMENT,
      side: DoubleSide,
      // keeps lines on the surface visible
      polygonOffset: true,
      polygonOffsetFactor: 1,
      polygonOffsetUnits: 1,
      uniforms: {
        mode: { value: 0 },
        scaleEnd: { value: 1e-3 },
        categories: { value: Array.from({ length: CATEGORIES }, () => new Vector3()) },
        scale: { value: Array.from({ length: SCALE_STEPS }, () => new Vector3()) },
        unknown: { value: vector(UNKNOWN_COLOUR) },
      },
    });
  }

  /** @param scaleEnd largest number of the scale, m. */
  colourBy(mode: ColourMode, scaleEnd: number): void {
    this.uniforms.mode.value = MODE_NUMBERS[mode.name];
    this.uniforms.scaleEnd.value = scaleEnd;
    mode.categories?.forEach((category, i) => (this.uniforms.categories.value[i] = vector(category.colour)));
    mode.scale.forEach((colour, i) => (this.uniforms.scale.value[i] = vector(colour)));
  }
}

/** A colour in the space of the screen: the shader computes light there too, so that legend and part have the same colours. */
function vector(hex: string): Vector3 {
  return new Vector3(...rgb(hex));
}

