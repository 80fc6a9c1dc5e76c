//! A VLP-16 turn as `velodyne_msgs/VelodyneScan`: exact to the bit, misses kept.
//!
//! `header.stamp` is the end of the turn, each packet's stamp its first firing.

use super::error::Refusal;
use super::ros2::{Header, Stamp, VelodynePacket, VelodyneScan};
use arborloop_base::vlp16::{self, PACKET_BYTES, Packet, ReturnMode};
use arborloop_base::{Span, Sweep};

/// No scan lasts longer: the slowest turn takes a fifth of a second (300 rpm).
const SCAN_MAX: Span = Span::from_millis(10_000);

/// The turn as packets. A turn without a single firing keeps its start in one packet without blocks.
pub(super) fn message_of(sweep: &Sweep, mode: ReturnMode, frame: &str) -> Result<VelodyneScan, Refusal> {
    let refused = |error: vlp16::WireError| Refusal::new(error.to_string(), "a sweep of a VLP-16");
    let mut packets = vlp16::encode_as(sweep, mode).map_err(refused)?;
    if packets.is_empty() {
        let mut payload = [0; PACKET_BYTES];
        // Return mode and VLP-16 (manual p. 57): the factory bytes that every packet ends with.
        payload[PACKET_BYTES - 2..].copy_from_slice(&[mode.byte(), 0x22]);
        packets.push(Packet { stamp: sweep.start, payload });
    }
    let packets = packets
        .into_iter()
        .map(|packet| Ok(VelodynePacket { stamp: Stamp::of(packet.stamp)?, data: packet.payload }))
        .collect::<Result<_, Refusal>>()?;
    Ok(VelodyneScan { header: Header::new(sweep.end, frame)?, packets })
}

/// The turn of a scan. The driver of a real sensor stamps the scan with its last packet: where packets reach past
/// the stamp, the turn ends behind the last firing cycle instead.
pub(super) fn sweep_of(scan: &VelodyneScan) -> Result<Sweep, Refusal> {
    let packets: Vec<Packet> = scan
        .packets
        .iter()
        .map(|packet| Packet { stamp: packet.stamp.time(), payload: packet.data })
        .collect();
    let stamp = scan.header.stamp.time();
    let end = match packets.last() {
        Some(last) if last.stamp >= stamp => last.stamp + vlp16::CYCLE_STEP * 24,
        _ => stamp,
    };
    let increasing = packets.windows(2).all(|pair| pair[0].stamp < pair[1].stamp);
    let start = packets.first().map_or(end, |first| first.stamp);
    if !increasing || start > end || end - start > SCAN_MAX {
        return Err(Refusal::new(
            format!("{} packets from {start} on in a scan that ends at {end}", packets.len()),
            "packets whose stamps increase and lie within ten seconds before the end",
        ));
    }
    vlp16::decode(&packets, end).map_err(|error| Refusal::new(error.to_string(), "packets of a VLP-16"))
}
