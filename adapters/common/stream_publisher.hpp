#pragma once

#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "adapters/common/epoch_publisher.hpp"
#include "canyon/options/visitor.hpp"
#include "canyon/output/encoder.hpp"
#include "canyon/output/stream.hpp"
#include "canyon/transport/link.hpp"

namespace canyon::adapters {

/// Opens the link of a host's own address, such as a topic; null: the address is the engine's.
using LinkOpener = std::function<std::shared_ptr<transport::Link>(const output::StreamRequest& request)>;

/// Epochs in any of the engine's formats by any of its transports: "nmea=tcp://127.0.0.1:10110" (see
/// output::parse_stream() and transport::open_transport()). Files are whole when it is destroyed. Updates
/// without an epoch send nothing: readers take a silent receiver for a lost one. Latencies pass by the host's
/// clock.
/// @param setting the setting of the stream, for messages: "nmea_port"
/// @param receivers of the host's receiver, which a stream that names none is of, and of its base, if any:
/// "base/rtcm=tcp://127.0.0.1:2102"
/// @param open asked first
/// @param device gets what a driver sends to the host's receiver over its line: corrections and restarts;
/// null: nobody. It outlives the publisher.
/// Throws InputError, which names `setting`, where the stream cannot be opened.
[[nodiscard]] std::unique_ptr<EpochPublisher> make_stream_publisher(
    const std::string& setting, std::string_view stream,
    const std::vector<output::ReceiverDescription>& receivers, const LinkOpener& open = {},
    simulation::LiveReceiver* device = nullptr);

/// `stream` with `{model}` replaced by a model's name and `{number}` by the number at its end, 0 without one,
/// so that one setting serves several vehicles: of x500_1 "ubx=pty:/tmp/gps{number}" is "ubx=pty:/tmp/gps1".
/// Throws InputError, which names `setting`, for other names in braces.
[[nodiscard]] std::string stream_of_model(const std::string& setting, const std::string& stream,
                                          const std::string& model);

/// The field of such texts. A reader throws its fault for a format that is not known.
void visit_streams(options::Visitor& v, const options::Field& field, std::vector<std::string>& streams);

}  // namespace canyon::adapters
