//! Which scenario is asked of which drive. A further drive is a further name in these rows, and its bench.

ferrodrive_tests::scenarios! {
    objects {
        are_read_with_their_width_and_default: zlac8030l zlim42c mjoint cia402;
        refuse_writes_where_they_are_read_only: zlac8030l zlim42c mjoint cia402;
        take_their_range_and_refuse_what_lies_beyond: zlac8030l zlim42c mjoint cia402;
        refuse_what_the_manual_does_not_have: zlac8030l zlim42c mjoint cia402;
        refuse_another_width: zlac8030l zlim42c mjoint cia402;
        read_at_rest_what_a_resting_drive_has: zlac8030l zlim42c mjoint cia402;
        have_the_factory_values_of_the_eds_where_that_is_chosen: zlac8030l zlim42c;
        outlive_a_power_cycle_if_and_only_if_stored: zlac8030l zlim42c;
        are_kept_and_restored_only_on_command: zlac8030l zlim42c;
        are_saved_together_or_not_at_all: zlac8030l zlim42c;
    }
    power {
        every_event_in_every_state_leads_where_the_table_says: zlac8030l zlim42c cia402;
        a_drive_says_that_it_has_booted_and_is_in_switch_on_disabled: zlac8030l zlim42c cia402;
        a_fault_is_told_and_goes_with_a_rising_bit_7_once_its_cause_is_gone: zlac8030l zlim42c cia402;
        the_statusword_of_each_state_in_each_mode_at_rest_is_that_of_the_table: zlac8030l zlim42c cia402;
    }
    network {
        commands_to_all_nodes_and_to_this_one_act_and_commands_to_others_do_not: zlac8030l zlim42c mjoint cia402;
        a_reset_leaves_the_node_able_to_speak: zlac8030l zlim42c;
        a_stopped_node_answers_no_sdo_and_its_motor_goes_on: zlac8030l zlim42c cia402;
        a_communication_reset_leaves_the_motor_turning_and_a_node_reset_frees_it: zlac8030l zlim42c cia402;
        the_heartbeat_comes_back_by_itself_after_a_power_cycle: zlac8030l zlim42c cia402;
        a_heartbeat_of_100_ms_comes_a_hundred_times_in_ten_seconds_without_drift_and_one_of_0_never: zlac8030l zlim42c mjoint cia402;
        emcy_is_sent_on_the_identifier_of_1014h_and_not_at_all_with_bit_31: zlac8030l zlim42c cia402;
        no_emcy_and_no_pdo_leave_a_stopped_node: zlac8030l zlim42c cia402;
        sync_is_heard_on_the_identifier_of_1005h: zlac8030l zlim42c cia402;
        nothing_that_the_manual_does_not_name_is_answered: zlac8030l zlim42c mjoint;
        remote_frames_get_no_answer_though_the_cob_ids_say_that_rtr_is_allowed: zlac8030l zlim42c mjoint;
    }
    sdo {
        malformed_requests_are_survived_and_change_nothing: zlac8030l zlim42c cia402;
        a_block_transfer_is_refused_and_an_abort_in_its_place_is_ignored: zlac8030l zlim42c mjoint;
        an_answer_comes_within_about_a_millisecond: zlac8030l zlim42c cia402;
        a_segmented_download_carries_a_small_object_too: zlac8030l zlim42c mjoint cia402;
        an_expedited_download_without_a_size_takes_what_the_object_needs: zlac8030l zlim42c mjoint cia402;
        an_upload_ignores_its_low_five_bits_and_three_bytes_are_too_few: zlac8030l zlim42c mjoint cia402;
        requests_sent_without_waiting_for_answers_are_all_answered_in_order: zlac8030l zlim42c mjoint cia402;
    }
    pdo {
        an_rpdo_acts_in_operational_only: zlac8030l zlim42c cia402;
        each_of_the_four_rpdos_sets_the_objects_it_maps: zlac8030l zlim42c cia402;
        each_of_the_four_tpdos_tells_the_objects_it_maps: zlac8030l zlim42c cia402;
        an_rpdo_of_types_0_to_240_waits_for_the_sync_and_one_of_254_or_255_does_not: zlac8030l zlim42c cia402;
        a_synchronous_tpdo_comes_with_each_nth_sync_and_one_of_type_0_after_a_change: zlac8030l zlim42c cia402;
        each_asynchronous_tpdo_is_sent_once_on_entering_operational: zlac8030l zlim42c cia402;
        inhibit_time_and_event_timer_count_half_milliseconds: zlac8030l zlim42c;
        a_pdo_is_mapped_with_bit_31_as_masters_do_and_without_as_the_manuals_do: zlac8030l zlim42c;
        a_switched_off_pdo_is_silent_and_deaf: zlac8030l zlim42c cia402;
        a_wrong_mapping_is_refused_with_the_codes_of_cia_301: zlac8030l zlim42c;
        what_the_table_refuses_an_rpdo_does_not_do_either: zlac8030l zlim42c;
        a_short_rpdo_is_not_half_applied_and_a_long_one_counts_as_far_as_mapped: zlac8030l zlim42c cia402;
        an_rpdo_that_is_too_short_is_told_once_by_8210h_and_one_that_is_too_long_is_not: zlac8030l zlim42c cia402;
        controlword_and_target_in_one_rpdo_start_the_move_whichever_comes_first: zlac8030l zlim42c cia402;
        a_stored_mapping_works_after_a_power_cycle: zlac8030l zlim42c cia402;
        a_reserved_transmission_type_is_refused: zlac8030l zlim42c cia402;
    }
    motion {
        clearing_the_position_reads_zero_again_and_zeroes_the_position: zlac8030l zlim42c;
        another_mode_waits_until_the_motor_stands: zlac8030l zlim42c;
        a_second_set_point_waits_for_the_first_and_a_third_is_not_taken: zlac8030l zlim42c cia402;
        a_motion_begins_at_its_start_speed_and_a_move_ends_from_6082h: zlac8030l zlim42c;
        a_reversal_ramps_down_by_6084h_and_up_by_6083h: zlac8030l zlim42c cia402;
    }
    stops {
        halt_takes_the_ramp_of_605dh_in_every_mode_and_stays_enabled: zlac8030l zlim42c cia402;
        quick_stop_takes_the_ramp_of_605ah_in_every_mode_and_holds: zlac8030l zlim42c cia402;
        shutdown_and_disable_operation_ramp_down_before_they_act_or_act_at_once: zlac8030l zlim42c cia402;
        disable_voltage_frees_the_motor_at_once_in_every_mode: zlac8030l zlim42c cia402;
        a_halted_move_goes_on_to_its_target: zlac8030l zlim42c cia402;
        a_set_point_given_under_halt_waits_for_its_end: zlac8030l zlim42c cia402;
    }
    terminals {
        an_output_tells_what_its_function_names_in_either_polarity: zlac8030l zlim42c;
        a_drive_without_power_has_its_outputs_off: zlac8030l zlim42c;
        input_status_shows_the_levels_whatever_the_polarity_and_the_functions: zlac8030l zlim42c;
        a_stop_input_that_is_active_low_stops_a_drive_that_has_just_started_only_if_it_is_low: zlac8030l zlim42c;
    }
}
