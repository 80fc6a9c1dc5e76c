//! The one door to CDR (OMG Common Data Representation), the payload of ROS 2 messages.
//!
//! A payload is four bytes of encapsulation header, then plain CDR whose alignment counts from behind them. We write
//! little endian and read both.

use super::error::Refusal;
use super::ros2::Message;
use byteorder::{BigEndian, LittleEndian};

const LITTLE_ENDIAN_CDR: [u8; 4] = [0, 1, 0, 0];

/// The payload of a message.
pub(super) fn encode<M: Message>(message: &M) -> Result<Vec<u8>, Refusal> {
    let mut payload = LITTLE_ENDIAN_CDR.to_vec();
    let body = cdr_encoding::to_vec::<M, LittleEndian>(message)
        .map_err(|error| Refusal::new(error.to_string(), format!("a {} that CDR can hold", M::TYPE)))?;
    payload.extend_from_slice(&body);
    Ok(payload)
}

/// The message of a payload; bytes behind the message are padding.
pub(super) fn decode<M: Message>(payload: &[u8]) -> Result<M, Refusal> {
    let wanted = || format!("the CDR bytes of a {}", M::TYPE);
    let Some((header, body)) = payload.split_first_chunk::<4>() else {
        return Err(Refusal::new(format!("{} bytes", payload.len()), wanted()));
    };
    let decoded = match header[..2] {
        [0, 1] => cdr_encoding::from_bytes::<M, LittleEndian>(body),
        [0, 0] => cdr_encoding::from_bytes::<M, BigEndian>(body),
        _ => {
            let found = format!("encapsulation header {:02x} {:02x}", header[0], header[1]);
            return Err(Refusal::new(found, "00 01 or 00 00 (plain CDR)"));
        }
    };
    decoded.map(|(message, _)| message).map_err(|error| {
        Refusal::new(format!("{} bytes that do not decode ({error})", payload.len()), wanted())
    })
}

/// Fixed arrays of any length for serde, whose own support ends at 32: CDR writes them without a length.
pub(super) mod array {
    use serde::de::{Error, SeqAccess, Visitor};
    use serde::ser::SerializeTuple;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};
    use std::fmt;
    use std::marker::PhantomData;

    /// Writes the elements one after another.
    pub(in super::super) fn serialize<S: Serializer, T: Serialize, const N: usize>(
        array: &[T; N],
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        let mut tuple = serializer.serialize_tuple(N)?;
        for element in array {
            tuple.serialize_element(element)?;
        }
        tuple.end()
    }

    /// Reads exactly `N` elements.
    pub(in super::super) fn deserialize<
        'de,
        D: Deserializer<'de>,
        T: Deserialize<'de> + Copy + Default,
        const N: usize,
    >(
        deserializer: D,
    ) -> Result<[T; N], D::Error> {
        struct Elements<T, const N: usize>(PhantomData<T>);

        impl<'de, T: Deserialize<'de> + Copy + Default, const N: usize> Visitor<'de> for Elements<T, N> {
            type Value = [T; N];

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                write!(f, "{N} elements")
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut elements: A) -> Result<Self::Value, A::Error> {
                let mut array = [T::default(); N];
                for (index, slot) in array.iter_mut().enumerate() {
                    *slot = elements.next_element()?.ok_or_else(|| A::Error::invalid_length(index, &self))?;
                }
                Ok(array)
            }
        }

        deserializer.deserialize_tuple(N, Elements(PhantomData))
    }
}
