// The whole codec in one include: structs, frames, parser, encoder.
#pragma once

#include "messages/frame_encoder.h"
#include "messages/frame_layout.h"
#include "messages/frame_parser.h"
#include "messages/mavlink_messages.h"
