// What writer and reader of VRML worlds agree on about how a face looks.
#pragma once

namespace wasp::sim {

inline constexpr float kVrmlExposure = 1.5f;  ///< brightness of a face of colour 1
inline constexpr char kVrmlBakedLight[] = "wasp: light is baked into the colours; exposure 1.5";
inline constexpr char kVrmlSmooth[] = "wasp: surfaces are smooth";  ///< no fine grain

}  // namespace wasp::sim
