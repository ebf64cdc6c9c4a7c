// Names of the regions and topics: the one list that writers and readers share.
//
//   wasp.<instance>.camera   gray, depth, gray.down,     written by whoever is the camera (simulator, replay, wasp
//                            camera, camera.down         camera); *.down only where a camera looks down, the blocks
//                                                        camera* only from wasp camera
//   wasp.<instance>.relay    as .camera                  written by a flight process with fault points only: what its
//                                                        behaviours see instead (scheduling/camera_relay.h)
//   wasp.<instance>.flight   imu, attitude, position, flow, flow.down, cue.<behaviour>, command, stages, run
//                                                        written by the flight process; a flow ring only where a
//                                                        behaviour makes it, a cue ring for every enabled behaviour
//   wasp.<instance>.truth    truth                       written by the simulator; no flight thread reads it
#pragma once

#include <cstdint>
#include <string>

namespace wasp::shm {

inline std::string camera_region(const std::string& instance) { return "wasp." + instance + ".camera"; }
inline std::string relay_region(const std::string& instance) { return "wasp." + instance + ".relay"; }
inline std::string flight_region(const std::string& instance) { return "wasp." + instance + ".flight"; }
inline std::string truth_region(const std::string& instance) { return "wasp." + instance + ".truth"; }

inline constexpr const char* kGray = "gray";           ///< type Frame: FrameHeader, then pixels at kFramePixelOffset
inline constexpr const char* kDepth = "depth";         ///< type Frame; before the grey frame of the same exposure
inline constexpr const char* kGrayDown = "gray.down";  ///< type Frame: the camera that looks down
inline constexpr const char* kCamera = "camera";       ///< block, type CameraStatus (drivers/camera_status.h)
inline constexpr const char* kCameraDown = "camera.down";  ///< likewise
inline constexpr const char* kFlow = "flow";           ///< type Flow: FlowMessage first (scheduling/flow_ring.h)
inline constexpr const char* kFlowDown = "flow.down";  ///< type Flow: of the camera that looks down
inline constexpr const char* kImu = "imu";             ///< type Imu: ImuSample
inline constexpr const char* kAttitude = "attitude";   ///< type Attitude: AttitudeSample
inline constexpr const char* kPosition = "position";   ///< type Position: PositionSample, where the autopilot tells it
inline constexpr const char* kCommand = "command";     ///< type Command
inline constexpr const char* kTruth = "truth";         ///< type Truth
inline constexpr const char* kStages = "stages";       ///< block, type StageTable: latency of every stage
inline std::string cue_topic(const std::string& behaviour) { return "cue." + behaviour; }  ///< type Cue

inline constexpr std::uint32_t kFrameSlots = 8;  ///< 266 ms at 30 Hz
inline constexpr std::uint32_t kFlowSlots = 16;  ///< more than twice what a replay lets lie unread (replay_camera.cpp)
inline constexpr std::uint32_t kImuSlots = 512;  ///< 2.5 s at 200 Hz: history to match a frame against
inline constexpr std::uint32_t kAttitudeSlots = 256;
inline constexpr std::uint32_t kPositionSlots = 64;
inline constexpr std::uint32_t kCueSlots = 64;
inline constexpr std::uint32_t kCommandSlots = 64;
inline constexpr std::uint32_t kTruthSlots = 512;

}  // namespace wasp::shm
