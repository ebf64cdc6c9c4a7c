// wasp eval mavlink: what recorded MAVLink logs hold, and whether the parser finds it again under damage.
#pragma once

namespace wasp::tools {

/// `argv[0]` is "mavlink". Exit code 0: all as it should be; 1: a frame was lost or wrong; 2: no log, or a file is no good.
int eval_mavlink_main(int argc, char** argv);

}  // namespace wasp::tools
