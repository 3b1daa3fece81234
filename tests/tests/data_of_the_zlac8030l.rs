//! The data files agree with themselves and with CiA 301: before they judge a drive, they are judged.

use ferrodrive_tests::zlac8030l::{datagrams, objects};

#[test]
fn every_printed_answer_is_the_answer_that_the_standard_demands() {
    let datagrams = datagrams();
    assert_eq!(datagrams.len(), 98);
    for datagram in datagrams.iter().filter(|datagram| datagram.request.is_some()) {
        if let Some((cob, data)) = &datagram.response {
            assert_eq!(*cob, 0x584, "{datagram:?}");
            let printed: Vec<_> = data.iter().copied().map(Some).collect();
            assert_eq!(printed, datagram.answer, "{datagram:?}");
        }
    }
}

#[test]
fn every_sdo_datagram_names_an_object_of_the_table_and_carries_its_size() {
    let (objects, datagrams) = (objects(), datagrams());
    let requests: Vec<_> = datagrams.iter().filter(|it| matches!(it.request, Some((0x604, _)))).collect();
    assert!(!requests.is_empty());
    for datagram in requests {
        datagram.check_sdo_request(&objects, 4);
    }
}

#[test]
fn every_range_of_the_object_table_holds_more_than_one_value() {
    assert!(objects().iter().all(|row| row.limits.is_none_or(|(low, high)| low < high)));
}
